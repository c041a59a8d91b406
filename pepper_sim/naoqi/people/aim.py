"""Aiming head and arms at a place. Places in the odometry frame [m], angles [rad]."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from pepper_sim.naoqi.motion.frames import FRAME_LINKS
from pepper_sim.naoqi.service import ServiceError, one_of
from pepper_sim.robot import Pepper
from pepper_sim.services.al_motion import ALMotion

HEAD = ("HeadYaw", "HeadPitch")
ARMS: Mapping[str, tuple[str, ...]] = {"LArm": ("L",), "RArm": ("R",), "Arms": ("L", "R")}
"""Effector -> sides of the arms that point."""
CYCLE = 0.15
"""A head that follows something is there after this time [s]: one and a half looks."""
_STILL = 0.015
_STRAIGHT = 0.02
_PALM_ASIDE = 0.0
_OPEN = 0.98


def to_world(robot: Pepper, position: Sequence[float], frame: int, argument: str = "position") -> np.ndarray:
    """Return a place [x, y, z] of frame 0 torso, 1 world or 2 robot in the odometry frame, (3,).

    Raises: ServiceError: There is no such frame, or the place has not three numbers.
    """
    one_of(frame, FRAME_LINKS, "frame")
    if len(position) != 3:
        raise ServiceError(f"{argument} must be [x, y, z], got {len(position)} numbers")
    link = FRAME_LINKS[frame]
    with robot.world.locked():
        reference = np.eye(4) if link is None else robot.link_pose(link)
    return (reference @ [*position, 1.0])[:3]


def from_world(robot: Pepper, place: Sequence[float], frame: int) -> list[float]:
    """Return a place of the odometry frame in frame 0 torso, 1 world or 2 robot.

    Raises: ServiceError: There is no such frame.
    """
    link = FRAME_LINKS[one_of(frame, FRAME_LINKS, "frame")]
    with robot.world.locked():
        reference = np.eye(4) if link is None else robot.link_pose(link)
    return (np.linalg.inv(reference) @ [*place, 1.0])[:3].tolist()


def head_angles(robot: Pepper, place: Sequence[float]) -> dict[str, float]:
    """Return the angles with which the top camera looks at a place."""
    with robot.world.locked():
        torso, head = robot.link_pose("torso"), robot.link_pose("Head")
    x, y, z = (torso[:3, :3].T @ (np.asarray(place) - head[:3, 3])).tolist()
    return {"HeadYaw": math.atan2(y, x), "HeadPitch": -math.atan2(z, math.hypot(x, y))}


def turn_head(robot: Pepper, motion: ALMotion, angles: Mapping[str, float], velocity: float) -> None:
    """Turn the head towards angles, no faster than `velocity` [rad/s]; not while a motion uses it."""
    if motion.tasks.using(HEAD):
        return
    now = robot.snapshot().joint_setpoints
    errors = {joint: abs(angle - now[joint]) for joint, angle in angles.items()}
    if max(errors.values()) > _STILL:
        robot.set_angles(angles, {joint: min(velocity, error / CYCLE + 0.01) for joint, error in errors.items()})


def arm_angles(robot: Pepper, effector: str, place: Sequence[float]) -> dict[str, float]:
    """Return the angles with which the arms of an effector, stretched, point from their shoulders to a place."""
    angles: dict[str, float] = {}
    with robot.world.locked():
        torso = robot.link_pose("torso")
        shoulders = {side: robot.link_pose(f"{side}Shoulder")[:3, 3] for side in ARMS[effector]}
    for side, shoulder in shoulders.items():
        x, y, z = (torso[:3, :3].T @ (np.asarray(place) - shoulder)).tolist()
        bent = _STRAIGHT if side == "R" else -_STRAIGHT
        angles |= {
            f"{side}ShoulderPitch": math.atan2(-z, x),
            f"{side}ShoulderRoll": math.atan2(y, math.hypot(x, z)),
            f"{side}ElbowYaw": 0.0,
            f"{side}ElbowRoll": bent,
            f"{side}WristYaw": _PALM_ASIDE,
            f"{side}Hand": _OPEN,
        }
    return angles
