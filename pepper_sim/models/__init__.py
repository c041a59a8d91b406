"""Pepper's body: `pepper.xml` with shells lofted in Python, our own shapes around the published frames."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from pepper_sim.body.description import EYES, HEADS, STEREO_DEPTH_FOVY, STEREO_FOVY
from pepper_sim.models.charging_station import add_station
from pepper_sim.models.shells import add_shells
from telepresence.sim.scene import RobotModel

MJCF = Path(__file__).parent / "pepper.xml"
PREFIX = "pepper/"


def load_pepper(head: str = HEADS[0], station: tuple[float, float, float] | None = None) -> mujoco.MjSpec:
    """Return a new Pepper: root body `base_footprint` on the floor with a free joint, 17 joints, servos, cameras.

    Args:
        head: Version of the head, one of `pepper_sim.body.description.HEADS`.
        station: Where the robot stands on its charging station, seen from where it starts [m, m, rad]; None for none.
    """
    spec = mujoco.MjSpec.from_file(str(MJCF))
    add_shells(spec)
    if head == "1.8":
        spec.camera("CameraDepth").fovy = STEREO_DEPTH_FOVY
        for name, place in EYES.items():
            spec.body("Head").add_camera(name=name, pos=place, xyaxes=(0, -1, 0, 0, 0, 1), fovy=STEREO_FOVY)
    if station is not None:
        add_station(spec, *station)
    return spec


def pepper_model(
    prefix: str = PREFIX,
    spawn: str = "spawn_pepper",
    offset: tuple[float, float] = (0.0, 0.0),
    head: str = HEADS[0],
    station: tuple[float, float, float] | None = None,
    furnish: Callable[[mujoco.MjSpec, np.ndarray], None] | None = None,
) -> RobotModel:
    """Return Pepper for `telepresence.sim.scene.build_world`; head and station as of `load_pepper`, `furnish` adds to
    its scene, see `RobotModel`.

    Raises:
        ValueError: There is no such head.
    """
    if head not in HEADS:
        raise ValueError(f"Pepper has no head {head!r}; heads: {', '.join(HEADS)}")
    return RobotModel(functools.partial(load_pepper, head, station), prefix, spawn, offset, furnish)
