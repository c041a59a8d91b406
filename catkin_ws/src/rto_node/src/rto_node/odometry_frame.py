"""OdometryFrame: the robot's own odometry, seen from an origin that we choose. No ROS.

Robotino's REST interface cannot set odometry, so a reset happens here. When the robot's odometry starts again (the
robot was restarted: its count of readings goes back), ours goes on from where it was.
"""

from __future__ import annotations

import math

from rto_node.client import Odometry
from telepresence.geometry import Pose, wrap_angle


class OdometryFrame:
    """Turns readings into poses in the frame odom. One thread, or a lock around it."""

    def __init__(self) -> None:
        self.restarts = 0
        """How often the robot's odometry has started again."""
        self._offset = Pose(0.0, 0.0, 0.0)  # of the robot's frame in ours
        self._last = Pose(0.0, 0.0, 0.0)  # the last pose in ours
        self._seq: int | None = None

    def update(self, reading: Odometry) -> Pose:
        """Return the pose in odom for a reading."""
        pose = Pose(reading.x, reading.y, reading.phi)
        if self._seq is not None and reading.seq < self._seq:
            self.restarts += 1
            self._offset = _compose(self._last, _invert(pose))
        self._seq = reading.seq
        self._last = _compose(self._offset, pose)
        return self._last

    def reset(self, x: float, y: float, phi: float) -> None:
        """Let the robot be at this pose now [m, m, rad]."""
        pose = _compose(_invert(self._offset), self._last)
        self._last = Pose(x, y, wrap_angle(phi))
        self._offset = _compose(self._last, _invert(pose))


def _compose(a: Pose, b: Pose) -> Pose:
    c, s = math.cos(a.theta), math.sin(a.theta)
    return Pose(a.x + c * b.x - s * b.y, a.y + s * b.x + c * b.y, wrap_angle(a.theta + b.theta))


def _invert(a: Pose) -> Pose:
    c, s = math.cos(a.theta), math.sin(a.theta)
    return Pose(-c * a.x - s * a.y, s * a.x - c * a.y, -a.theta)
