"""ReadingCount: since when the robot counts no further readings of its odometry. No ROS, no clock.

A robot numbers its odometry, 20 times a second whether it drives or stands. A web server that lives on while the
program that moves the robot has died, or that answers from a cache, repeats the last values: they look fresh, and
nothing else about a robot that stands tells them from new ones.
"""

from __future__ import annotations

import math

FROZEN_AFTER = 0.5
"""Seconds without a further reading after which what the web server says counts as old."""


class ReadingCount:
    """Takes the numbers of the readings as they come.

    Attributes:
        stamp: When the newest reading came [s]; minus infinity until a second one has shown that the robot counts.
        restarts: How often the count has gone back: the robot was started again, or its odometry was set.
    """

    def __init__(self) -> None:
        self.stamp = -math.inf
        self.restarts = 0
        self._seq: int | None = None
        self._since = math.inf

    def take(self, seq: int, now: float) -> bool:
        """Take an answer; True if it is a further reading of a robot that counts.

        Args:
            seq: The reading's number.
            now: When it was asked for [s].
        """
        if seq == self._seq:
            return False
        last, self._seq, self._since = self._seq, seq, now
        if last is None:
            return False
        self.restarts += seq < last
        self.stamp = now
        return True

    def problem(self, now: float) -> str:
        """Return what is wrong with an answer that was asked for `now` [s], to follow the robot's name; empty if
        nothing is."""
        if now - self._since <= FROZEN_AFTER:
            return ""
        return "repeats old values: its odometry counts no further readings"
