"""The bubble of the Robotino guide, kept as it is to be measured against. Not for driving a robot.

Nine points around the robot, a circle, and one prediction: a command that leaves a point inside the circle is replaced
by its turning alone. It acts only when a command comes, keeps no memory, checks no time stamp and predicts no
turning.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rto_node.robot_facts import guide_points

LOOK_AHEAD = 0.8
"""The guide's prediction time [s]."""


@dataclass(frozen=True)
class ClampLimits:
    """Limits of the guide's driver node: larger values are cut, smaller ones but zero are raised.

    Args:
        max_linear, min_linear: [m/s]. A driver in circulation ships 0.02 and 0.05: everything becomes 0.02.
        max_angular, min_angular: [rad/s].
    """

    max_linear: float = 0.20
    min_linear: float = 0.05
    max_angular: float = 1.0
    min_angular: float = 0.10


def clamp(value: float, largest: float, smallest: float) -> float:
    """The guide's mapping of one axis: a size above `largest` is cut to it, else one below `smallest` is raised."""
    size = abs(value)
    if size > largest:
        return math.copysign(largest, value)
    if 0.0 < size < smallest:
        return math.copysign(smallest, value)
    return value


def points_of_ranges(ranges: Sequence[float]) -> list[tuple[float, float]]:
    """Where the guide puts the returns of its nine beams, base_link [m]; "nothing" is a far point."""
    return [(x, y) for x, y, _ in guide_points(ranges)]


class Bubble:
    """The guide's filter.

    Args:
        radius: Of the circle around base_link [m]; the guide gives no number.
        limits: Of the clamp.
    Attributes:
        breach: Whether a point was inside the circle at the last command.
        safe_to_navigate: Whether none would have been inside it after that command; both None before the first.
    """

    def __init__(self, radius: float, limits: ClampLimits | None = None) -> None:
        self.radius = radius
        self._limits = limits or ClampLimits()
        self._points: Sequence[tuple[float, float]] | None = None
        self.breach: bool | None = None
        self.safe_to_navigate: bool | None = None

    def update_points(self, points: Sequence[tuple[float, float]]) -> None:
        """Replace the points (base_link) [m]. They stay valid until the next call, however long that takes."""
        self._points = points

    def command(self, vx: float, vy: float, wz: float) -> tuple[float, float, float] | None:
        """What is sent for a command [m/s, m/s, rad/s]; None if nothing is sent, for want of any points."""
        limits = self._limits
        vx = clamp(vx, limits.max_linear, limits.min_linear)
        vy = clamp(vy, limits.max_linear, limits.min_linear)
        wz = clamp(wz, limits.max_angular, limits.min_angular)
        if self._points is None:
            return None
        ahead = [(x - LOOK_AHEAD * vx, y - LOOK_AHEAD * vy) for x, y in self._points]
        self.breach = any(self._inside(x, y) for x, y in self._points)
        self.safe_to_navigate = not any(self._inside(x, y) for x, y in ahead)
        return (vx, vy, wz) if self.safe_to_navigate or not self.breach else (0.0, 0.0, wz)

    def _inside(self, x: float, y: float) -> bool:
        return x * x + y * y <= self.radius * self.radius
