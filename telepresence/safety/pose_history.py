"""Where the robot was when a measurement was made, and how far it has come."""

from __future__ import annotations

import math
from collections import deque

from .messages import Odometry

KEEP = 1.0
"""Length of the history [s]."""
TURN_ARM = 0.3
"""Turning by one radian counts as moving this far [m]."""


class PoseHistory:
    """The last second of odometry.

    Attributes:
        driven: Path length since the start [m].
        moved: The same with turning counted in [m].
    """

    def __init__(self) -> None:
        self._poses: deque[Odometry] = deque()
        self.driven = 0.0
        self.moved = 0.0

    def clear(self) -> None:
        """Forget the poses; path lengths go on."""
        self._poses.clear()

    @property
    def newest(self) -> Odometry | None:
        return self._poses[-1] if self._poses else None

    @property
    def current(self) -> Odometry:
        """The newest pose, for callers that have added one.

        Raises:
            IndexError: There is none.
        """
        return self._poses[-1]

    def add(self, odometry: Odometry) -> None:
        """Append a pose; one that isn't newer than the last is ignored."""
        last = self.newest
        if last is not None:
            if odometry.stamp <= last.stamp:
                return
            step = math.hypot(odometry.x - last.x, odometry.y - last.y)
            self.driven += step
            self.moved += step + TURN_ARM * abs(math.remainder(odometry.theta - last.theta, math.tau))
        self._poses.append(odometry)
        while self._poses[0].stamp < odometry.stamp - KEEP:
            self._poses.popleft()

    def at(self, stamp: float) -> tuple[float, float, float]:
        """Pose at a time within the history, its ends beyond (x, y [m], theta [rad])."""
        poses = self._poses
        later = poses[-1]
        if stamp >= later.stamp:
            return later.x, later.y, later.theta
        for index in range(len(poses) - 2, -1, -1):
            earlier = poses[index]
            if earlier.stamp <= stamp:
                share = (stamp - earlier.stamp) / (later.stamp - earlier.stamp)
                turned = math.remainder(later.theta - earlier.theta, math.tau)
                return (
                    earlier.x + share * (later.x - earlier.x),
                    earlier.y + share * (later.y - earlier.y),
                    earlier.theta + share * turned,
                )
            later = earlier
        return later.x, later.y, later.theta
