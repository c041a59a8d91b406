"""Velocity and pose in the plane, and angles: x forward, y left, counter-clockwise positive (REP 103).

Pure mathematics on standard Python types: a simulated robot and the driver that controls it may both use it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple


class Velocity(NamedTuple):
    """Velocity of a robot's base in its own frame (base_link).

    Args:
        vx: Forward [m/s].
        vy: To the left [m/s].
        wz: Counter-clockwise [rad/s].
    """

    vx: float
    vy: float
    wz: float


class Pose(NamedTuple):
    """Pose of a robot's base in a fixed frame (odom, map or world).

    Args:
        x, y: Position [m].
        theta: Heading, counter-clockwise from the x axis [rad].
    """

    x: float
    y: float
    theta: float


class RollPitchYaw(NamedTuple):
    """Rotations about the fixed axes x, y, z, in this order [rad]; pitch lies in [-pi/2, pi/2]."""

    roll: float
    pitch: float
    yaw: float


ZERO_VELOCITY = Velocity(0.0, 0.0, 0.0)


def require_finite(what: str, values: Iterable[float]) -> None:
    """Raise ValueError unless all values are finite numbers; the text calls them together `what`."""
    values = tuple(values)
    if not all(map(math.isfinite, values)):
        raise ValueError(f"a {what} must be finite numbers, got {values}")


def wrap_angle(angle: float) -> float:
    """Return the same direction in (-pi, pi] [rad].

    Raises:
        ValueError: The angle is infinite.
    """
    wrapped = math.remainder(angle, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def yaw_of(w: float, x: float, y: float, z: float) -> float:
    """Return the yaw [rad] of a unit quaternion, scalar first as in MuJoCo; ROS messages name their fields."""
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def roll_pitch_yaw(w: float, x: float, y: float, z: float) -> RollPitchYaw:
    """Return roll, pitch and yaw of a unit quaternion, scalar first as in MuJoCo."""
    return RollPitchYaw(
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        # Rounding may carry the sine just past one.
        math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
        yaw_of(w, x, y, z),
    )
