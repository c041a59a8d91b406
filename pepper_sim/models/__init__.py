"""Pepper's body: `pepper.xml` with shells lofted in Python, our own shapes around the published frames."""

from __future__ import annotations

from pathlib import Path

import mujoco

from pepper_sim.models.shells import add_shells
from telepresence.sim.scene import RobotModel

MJCF = Path(__file__).parent / "pepper.xml"
PREFIX = "pepper/"


def load_pepper() -> mujoco.MjSpec:
    """Return a new Pepper: root body `base_footprint` on the floor with a free joint, 17 joints, servos, cameras."""
    spec = mujoco.MjSpec.from_file(str(MJCF))
    add_shells(spec)
    return spec


def pepper_model(
    prefix: str = PREFIX, spawn: str = "spawn_pepper", offset: tuple[float, float] = (0.0, 0.0)
) -> RobotModel:
    """Return Pepper for `telepresence.sim.scene.build_world`."""
    return RobotModel(load_pepper, prefix, spawn, offset)
