"""Careful scan: the body turns to and fro while the robot drives where the pilot wants.

Nine beams 40 degrees apart see a tenth of the circle. Swung by more than 20 degrees to either side they see all of it,
and the obstacle memory keeps it. The pilot's heading is kept beside: commands are meant in it, and it is what the body
returns to.
"""

from __future__ import annotations

import math

from .robot_profile import Swing

HOME = 0.03
"""Nearer to the pilot's heading than this the body is back [rad]."""


class BodySwing:
    """Adds the swing to the pilot's turning, and turns the pilot's driving into the swung body's frame."""

    def __init__(self, swing: Swing) -> None:
        self._swing = swing
        self._heading: float | None = None
        self._side = 1.0
        self._last_offset = 0.0

    def forget(self) -> None:
        """The present heading of the body is the pilot's."""
        self._heading = None
        self._last_offset = 0.0

    def offset(self, theta: float) -> float:
        """How far the body is turned away from the pilot's heading [rad]."""
        return 0.0 if self._heading is None else math.remainder(theta - self._heading, math.tau)

    def rate(self, theta: float, pilot_rate: float, wanted: bool, dt: float) -> float:
        """Turning rate to add [rad/s].

        Args:
            theta: Heading of the body in the odometry frame [rad].
            pilot_rate: What the pilot's own turning comes to [rad/s].
            wanted: The robot is to look around now.
            dt: Time since the last call [s].
        """
        if self._heading is None:
            if not wanted:
                return 0.0
            self._heading = theta
        self._heading += pilot_rate * dt
        offset = self.offset(theta)
        measured = (offset - self._last_offset) / dt if dt > 0.0 else 0.0
        self._last_offset = offset
        swing = self._swing
        if not wanted:
            if abs(offset) < HOME:
                self.forget()
                return 0.0
            return max(-swing.rate, min(swing.rate, -2.0 * offset))
        # Turn round when the body, told so now, would come to rest at the amplitude.
        rest = offset + measured * swing.delay + 0.5 * measured * abs(measured) / swing.braking
        if rest * self._side >= swing.amplitude:
            self._side = -self._side
        return self._side * swing.rate
