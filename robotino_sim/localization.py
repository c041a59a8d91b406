"""Where the robot believes to be in the room: /data/pose of the localization service that some Robotinos run.

Observed on a real one: the estimate may start with a large error and improves as the robot drives. Not published, hence
chosen: how large, and within which distance it improves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telepresence.geometry import wrap_angle

START_ERROR, START_ANGLE_ERROR = 0.5, 0.2
"""Standard deviations of the estimate before the robot has moved [m, rad]."""
IMPROVEMENT_DISTANCE = 1.0
"""The error shrinks by a factor of e in this distance [m]; turning by a radian counts as much as a metre."""


@dataclass(frozen=True)
class PoseEstimate:
    """Pose in the room [m, m, rad] and the number of estimates before it."""

    x: float = 0.0
    y: float = 0.0
    phi: float = 0.0
    seq: int = 0


class Localization:
    """Follows the true pose with an error that driving reduces. One thread.

    Args:
        rng: Draws the error at the start; None for none.
    """

    def __init__(self, rng: np.random.Generator | None) -> None:
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Begin with an error of its own."""
        draw = self._rng.normal(size=3) if self._rng is not None else np.zeros(3)
        self._error = draw * (START_ERROR, START_ERROR, START_ANGLE_ERROR)
        self._last: tuple[float, float, float] | None = None
        self.estimate = PoseEstimate()

    def update(self, x: float, y: float, phi: float) -> None:
        """Make the next estimate from the true pose [m, m, rad]."""
        if self._last is not None:
            moved = math.hypot(x - self._last[0], y - self._last[1]) + abs(wrap_angle(phi - self._last[2]))
            self._error *= math.exp(-moved / IMPROVEMENT_DISTANCE)
        self._last = (x, y, phi)
        dx, dy, turned = self._error.tolist()
        self.estimate = PoseEstimate(x + dx, y + dy, wrap_angle(phi + turned), self.estimate.seq + 1)
