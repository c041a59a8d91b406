"""Where robots start: the spawn point of their kind, and free places around it for those that share one."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from telepresence.sim.scene import load_scene

SPACING = 0.9
"""Distance between the centres of neighbouring robots [m]; the widest robot needs 0.5 m."""
ROOM = 0.4
"""Nothing stands nearer to a robot's centre than this [m]."""
UNEVENNESS = 0.016
"""Largest difference in height of the floor under a robot [m]: rough ground is within it, a ramp is not."""
FARTHEST = 24
"""Width of the grid around a spawn point that is searched, in places."""

_HEIGHTS = (0.06, 0.3, 0.7, 1.1)
_DIRECTIONS = 24
_ABOVE = 0.2
_SIGHT = 1.5


class FreePlaces:
    """Hands out free places of one scene. A robot that starts at its spawn point is never moved."""

    def __init__(self, scene: str) -> None:
        """Raises ValueError: there is no such scene."""
        self._scene = scene
        self._model = load_scene(scene).compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._taken: list[np.ndarray] = []

    def find(self, spawn: str) -> tuple[float, float]:
        """Return the offset of the next free place from the site `spawn`, along its axes (x, y) [m]; (0, 0) at first.

        Raises:
            ValueError: The scene has no such site, or no room.
        """
        site = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE, spawn)
        if site < 0:
            raise ValueError(f"scene {self._scene!r} has no site {spawn!r}")
        origin, rotation = self._data.site_xpos[site], self._data.site_xmat[site].reshape(3, 3)
        for offset in _spiral():
            place = origin + rotation @ (*offset, 0.0)
            if self._far_from_robots(place) and (offset == (0.0, 0.0) or self._is_free(place, origin)):
                self._taken.append(place)
                return offset
        count = len(self._taken) + 1
        raise ValueError(f"scene {self._scene!r} has no room for robot number {count} at {spawn}: take a larger one")

    def _far_from_robots(self, place: np.ndarray) -> bool:
        return all(np.linalg.norm(place - other) >= SPACING - 1e-6 for other in self._taken)

    def _is_free(self, place: np.ndarray, origin: np.ndarray) -> bool:
        """Return whether the floor is level, nothing is near, and no wall separates the place from the spawn point."""
        around = [(math.cos(angle), math.sin(angle)) for angle in np.arange(_DIRECTIONS) * math.tau / _DIRECTIONS]
        for x, y in ((0.0, 0.0), *around):
            drop = self._cast(place, (ROOM * x, ROOM * y, _ABOVE), (0.0, 0.0, -1.0))
            if not abs(drop - _ABOVE) < UNEVENNESS:
                return False
        for height in _HEIGHTS:
            if any(self._cast(place, (0.0, 0.0, height), (x, y, 0.0)) < ROOM for x, y in around):
                return False
        way = origin - place
        distance = float(np.linalg.norm(way))
        return self._cast(place, (0.0, 0.0, _SIGHT), tuple(way / distance)) > distance

    def _cast(self, place: np.ndarray, start: tuple[float, ...], direction: tuple[float, ...]) -> float:
        hit = np.zeros(1, np.int32)
        distance = mujoco.mj_ray(
            self._model, self._data, place + np.array(start), np.array(direction), None, True, -1, hit
        )
        return distance if hit[0] >= 0 else math.inf


def _spiral() -> Iterator[tuple[float, float]]:
    """Yield points of a grid, nearest first; of equally near ones those at the sides before those in front."""
    count = range(-FARTHEST // 2, FARTHEST // 2 + 1)
    points = [(x * SPACING, y * SPACING) for x in count for y in count]
    yield from sorted(points, key=lambda point: (round(math.hypot(*point), 6), abs(point[0]), point[0] > 0, point[1]))
