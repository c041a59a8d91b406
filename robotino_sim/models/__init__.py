"""Robotino's body: `robotino.xml`, with the curved shells and the ring of infrared sensors added in Python."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco

from robotino_sim.infrared import COUNT, MOUNTING_HEIGHT, MOUNTING_RADIUS, RAY_START
from robotino_sim.models.shells import add_shells
from telepresence.sim.scene import RobotModel

MJCF = Path(__file__).parent / "robotino.xml"
PREFIX = "robotino/"


def load_robotino(laser: bool = False) -> mujoco.MjSpec:
    """Return a fresh Robotino: root body `base_link` on the floor with a free joint, servos, camera, sensor sites.

    Args:
        laser: Whether it carries the optional laser scanner.
    """
    spec = mujoco.MjSpec.from_file(str(MJCF))
    add_shells(spec)
    _add_infrared_sites(spec)
    if not laser:
        spec.delete(spec.body("laser_scanner"))
    return spec


def robotino_model(
    prefix: str = PREFIX,
    spawn: str = "spawn_robotino",
    offset: tuple[float, float] = (0.0, 0.0),
    *,
    laser: bool = False,
) -> RobotModel:
    """Return Robotino for `telepresence.sim.scene.build_world`."""
    return RobotModel(lambda: load_robotino(laser), prefix, spawn, offset)


def _add_infrared_sites(spec: mujoco.MjSpec) -> None:
    """Add the sites `infrared_0` ... `infrared_8`, x outward, where each sensor's rays start."""
    radius = MOUNTING_RADIUS - RAY_START
    for i in range(COUNT):
        angle = math.tau * i / COUNT
        spec.body("base_link").add_site(
            name=f"infrared_{i}",
            pos=[radius * math.cos(angle), radius * math.sin(angle), MOUNTING_HEIGHT],
            quat=[math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)],
            size=[0.004, 0.004, 0.004],
            rgba=[0.0, 0.0, 0.0, 0.0],
        )
