"""Whether the pilot keeps a robot that somebody has asked for: drive_lease only takes the request back."""

from __future__ import annotations

import math
import time

from telepresence.teleop.lease_topics import LeaseState

KEPT = 1.0
"""[s] for which nobody asks any more before the robot counts as kept: a silent window's request is not shown either,
and comes back with its next sign of life."""


class RequestToDrive:
    """The request of one account, as drive_lease shows it."""

    def __init__(self) -> None:
        self._pilot, self._gone_at = "", math.inf
        """Who was asked, and since when that is not shown any more."""

    def is_refused(self, state: LeaseState, name: str, heard: bool) -> bool:
        """Take what drive_lease says; return, once, whether the pilot keeps the robot.

        Args:
            name: Of the account.
            heard: Its window has sent a sign of life lately.
        """
        now = time.monotonic()
        if state.asking == name != state.pilot:
            self._pilot, self._gone_at = state.pilot, math.inf
        elif state.asking or state.pilot != self._pilot:
            self._pilot = ""
        elif self._pilot:
            self._gone_at = min(self._gone_at, now) if heard else math.inf
            if now - self._gone_at >= KEPT:
                self._pilot = ""
                return True
        return False
