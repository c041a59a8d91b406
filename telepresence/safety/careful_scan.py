"""Careful scan: the body turns to and fro while the robot drives where the pilot steers.

Nine beams 40 degrees apart see a tenth of the circle. Swung by more than 20 degrees to either side they see all of it,
and the obstacle memory keeps it. The pilot's heading is tracked separately: commands refer to it, and the body returns
to it.

How far a body turns on after it is told to turn back, and how long it takes from side to side, differ from robot to
robot and with the way to it (a real Robotino over Wi-Fi is 0.2 s late and takes 1.3 s to its full rate), so both are
measured at every turning point, and the robot drives no faster than it looks.
"""

from __future__ import annotations

import math
from collections import deque

from .braking import stopping_speed
from .obstacle_memory import FIRST_LIFETIME
from .robot_profile import Swing

HOME = 0.03
"""The body has returned when it is this close to the pilot's heading, and stays so [rad]."""
TURNED_BACK = 0.02
"""The body has turned back when it is this far from the farthest that it came [rad]."""
SMOOTHING = 0.5
"""Share of the newest difference in the measured rate: odometry may come more seldom than the gate asks."""
LEARNT = 0.5
"""Share of the newest turning point in what is known of the body's lead."""
LONGEST_LEAD = 1.0
"""[s]"""
FIRST = 2.0
"""From standing in the middle to one side and then to the other takes at most this many sweeps, where the body has not
turned that far lately for any other reason."""


class BodySwing:
    """Adds the swing to the pilot's turning, and rotates the pilot's velocity into the swung body's frame."""

    def __init__(self, swing: Swing) -> None:
        self._swing = swing
        self._lead = swing.lead
        self._last_sweep = swing.sweep
        self._side = 1.0
        self._headings: deque[tuple[float, float]] = deque()
        self.forget()

    def forget(self) -> None:
        """Take the body's present heading as the pilot's."""
        self._heading: float | None = None
        self._last_offset = self._measured = self._since = 0.0
        self._turned_back: tuple[float, float] | None = None
        self._farthest = 0.0
        self._swept = False

    def forget_surroundings(self) -> None:
        """Take the body's present heading as the pilot's, and count nothing as looked at."""
        self.forget()
        self._headings.clear()

    def fastest(self, sight: float, reaction: float, braking: float) -> float:
        """Return how fast the robot may drive to stop before whatever a beam that swings round meets at last [m/s].

        Args:
            sight: How far from the robot that is when a beam last looked beside it [m].
            reaction, braking: Of the base [s], [m/s²].
        """
        return float(stopping_speed(sight, reaction + self._blind_time(), braking))

    def offset(self, theta: float) -> float:
        """Return how far the body is turned away from the pilot's heading [rad]."""
        return 0.0 if self._heading is None else math.remainder(theta - self._heading, math.tau)

    def look(self, now: float, theta: float) -> None:
        """Take note of where the beams look.

        Args:
            now: [s].
            theta: Heading of the body in the odometry frame [rad].
        """
        if self._headings:
            last = self._headings[-1][1]
            theta = last + math.remainder(theta - last, math.tau)
        self._headings.append((now, theta))
        while now - self._headings[0][0] > FIRST_LIFETIME:  # what was met before may be forgotten
            self._headings.popleft()

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
        if dt > 0.0:
            self._measured += SMOOTHING * ((offset - self._last_offset) / dt - self._measured)
        self._last_offset = offset
        swing = self._swing
        if not wanted:
            if abs(offset) < HOME and abs(self._measured) * self._lead < HOME:
                self.forget()
                return 0.0
            # Slower than the body follows, or it would swing around the pilot's heading.
            return max(-swing.rate, min(swing.rate, -0.5 * offset / self._lead))
        self._learn_lead(offset)
        self._since += dt
        # Turn back when the body, told so now, would come to rest at the amplitude.
        if (offset + self._measured * self._lead) * self._side >= swing.amplitude:
            self._turn_back(offset)
        return self._side * swing.rate

    def _blind_time(self) -> float:
        """Return how long it takes until a beam has looked everywhere [s]: from side to side, as last time; longer if
        it is longer ago that the body turned by the gap between two beams, for whatever reason. If that was not lately:
        from the middle to one side and then to the other."""
        now = self._headings[-1][0] if self._headings else 0.0
        low, high = math.inf, -math.inf
        for at, heading in reversed(self._headings):
            low, high = min(low, heading), max(high, heading)
            if high - low >= self._swing.gap:
                return max(self._last_sweep, now - at)
        return FIRST * max(self._last_sweep, self._since)

    def _turn_back(self, offset: float) -> None:
        if self._swept:
            self._last_sweep = self._since
        self._swept = True
        self._turned_back = self._side * offset, self._side * self._measured
        self._farthest = self._side * offset
        self._since = 0.0
        self._side = -self._side

    def _learn_lead(self, offset: float) -> None:
        """Measure how long the body turned on, at the rate that it had, after it was told to turn back."""
        if self._turned_back is None:
            return
        reached = -self._side * offset
        self._farthest = max(self._farthest, reached)
        if reached > self._farthest - TURNED_BACK:
            return
        told_at, rate = self._turned_back
        self._turned_back = None
        if rate > 0.0:
            lead = min(LONGEST_LEAD, (self._farthest - told_at) / rate)
            self._lead += LEARNT * (lead - self._lead)
