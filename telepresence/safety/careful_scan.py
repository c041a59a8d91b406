"""Careful scan: the body turns to and fro while the robot drives where the pilot steers.

Nine beams 40 degrees apart see a tenth of the circle. Swung by more than 20 degrees to either side they see all of it,
and the obstacle memory keeps it. The pilot's heading is tracked separately: commands refer to it, and the body returns
to it.
"""

from __future__ import annotations

import math

from .robot_profile import Swing

HOME = 0.03
"""The body has returned when it is this close to the pilot's heading [rad]."""


class BodySwing:
    """Adds the swing to the pilot's turning, and rotates the pilot's velocity into the swung body's frame."""

    def __init__(self, swing: Swing) -> None:
        self._swing = swing
        self._heading: float | None = None
        self._side = 1.0
        self._last_offset = 0.0

    def forget(self) -> None:
        """Take the body's present heading as the pilot's."""
        self._heading = None
        self._last_offset = 0.0

    def offset(self, theta: float) -> float:
        """Return how far the body is turned away from the pilot's heading [rad]."""
        return 0.0 if self._heading is None else math.remainder(theta - self._heading, math.tau)

    def rate(self, theta: float, pilot_rate: float, wanted: bool, dt: float) -> float:
        """Return the turning rate to add [rad/s].

        Args:
            theta: Heading of the body in the odometry frame [rad].
            pilot_rate: The pilot's own turning, as limited [rad/s].
            wanted: Whether to swing now.
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
        # Reverse when the body, commanded so now, would come to rest at the amplitude.
        rest = offset + measured * swing.delay + 0.5 * measured * abs(measured) / swing.braking
        if rest * self._side >= swing.amplitude:
            self._side = -self._side
        return self._side * swing.rate
