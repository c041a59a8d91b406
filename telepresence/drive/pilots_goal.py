"""The newest goal that a pilot has given, and what the robot has said of it. No clock, no network, no lock."""

from __future__ import annotations

import math
import secrets

from telepresence.drive.datagram import DRIVING, ENDED, Goal, GoalState

GOAL_TIMEOUT = 0.5
"""Seconds within which the robot must say that it drives to a goal; older ones are not begun."""
ASKED = "asked"
"""State of a goal of which the robot has not said anything yet."""
OPEN = (ASKED, DRIVING)
"""States of a goal that is still to be reached."""


class PilotsGoal:
    """The goal that is open, at most one: a new one replaces it. Times are seconds on one monotonic clock."""

    def __init__(self) -> None:
        self._goal: Goal | None = None
        self._state = ENDED
        self._seen = -math.inf  # when it was given, or the robot said last that it drives there
        self._number = secrets.randbelow(1 << 48)  # another pilot's goals have other numbers

    def give(self, pose: tuple[float, float, float], now: float) -> int:
        """Take a pose relative to where the robot is now [m, m, rad]; return the goal's number."""
        self._number += 1
        self._goal = Goal(self._number, pose)
        self._state, self._seen = ASKED, now
        return self._number

    def end(self) -> None:
        """End the goal if it is open."""
        if self._state in OPEN:
            self._state = ENDED

    def end_begun(self) -> None:
        """End the goal if the robot drives there: to one that knows nothing of it any more it would be another goal,
        relative to where the robot is by then."""
        if self._state == DRIVING:
            self._state = ENDED

    def state(self, now: float) -> str:
        """Return `ASKED`, or one of `datagram.GOAL_STATES`; ended before the first, and when the robot is silent."""
        if now - self._seen > GOAL_TIMEOUT:
            self.end()
        return self._state

    def wanted(self, now: float) -> tuple[Goal, float] | None:
        """Return the open goal and when it was wanted last: one that is not known to be begun is as old as its giving,
        one that is was wanted just now."""
        state = self.state(now)
        if self._goal is None or state not in OPEN:
            return None
        return self._goal, self._seen if state == ASKED else now

    def reported(self, report: GoalState, now: float) -> None:
        """Take what the robot says of a goal."""
        if self._goal is not None and report.number == self._goal.number and self._state in OPEN:
            self._state, self._seen = report.state, now
