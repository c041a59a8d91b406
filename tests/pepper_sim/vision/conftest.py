"""A robot before which things stand that its extractors look for: two landmarks, a QR code, a picture, a red disc.

It takes the place of the robot that the other tests share, whose cameras see an empty room.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from naoqi_clients import connected

from pepper_sim.simulation import Simulation


@pytest.fixture(scope="session")
def marks() -> dict[int, tuple[float, float, float]]:
    """Number of a landmark -> where it stands before the robot: ahead, left, height [m]."""
    return {85: (1.2, 0.25, 1.3), 130: (1.5, -0.1, 1.6)}


@pytest.fixture(scope="session")
def code() -> str:
    """What the QR code says."""
    return "https://example.org/hello"


@pytest.fixture(scope="session")
def picture() -> np.ndarray:
    """A picture with many corners, (300, 400, 3) uint8 BGR."""
    pixels = np.full((300, 400, 3), 235, np.uint8)
    rng = np.random.default_rng(7)
    for _ in range(60):
        x, y = int(rng.integers(0, 380)), int(rng.integers(0, 280))
        colour = tuple(int(value) for value in rng.integers(0, 200, 3))
        cv2.rectangle(pixels, (x, y), (x + int(rng.integers(8, 50)), y + int(rng.integers(8, 50))), colour, -1)
    return pixels


@pytest.fixture(scope="module")
def simulation(
    tmp_path_factory: pytest.TempPathFactory, picture: np.ndarray, marks: dict, code: str
) -> Iterator[Simulation]:
    folder = tmp_path_factory.mktemp("posters")
    cv2.imwrite(str(folder / "picture.png"), picture)
    disc = np.full((200, 200, 3), 255, np.uint8)
    cv2.circle(disc, (100, 100), 80, (20, 20, 220), -1)
    cv2.imwrite(str(folder / "disc.png"), disc)
    posters = [f"mark:{number}@{x},{y},{z}" for number, (x, y, z) in marks.items()]
    posters += [f"code:{code}@1,-0.35,1.15", f"{folder}/picture.png@1.5,0.55,1.65,0,0.4"]
    posters += [f"{folder}/disc.png@1.5,-0.6,1.6,0,0.25"]
    with Simulation(scene="empty", port=0, posters=posters) as running:
        yield running


@pytest.fixture(scope="module")
def session(simulation: Simulation, qi: ModuleType) -> Iterator[Any]:
    with connected(qi, simulation.url) as client:
        yield client
