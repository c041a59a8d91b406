"""Who is in, as a page shows it: everybody with a window of the robot's drive_lease, by whatever program."""

from __future__ import annotations

import math
from typing import Any

from telepresence.teleop.lease_topics import LeaseState

PERIOD = 1.0
"""[s] between two lists that say the same: a state is sent ten times a second, and should stay one packet."""


def people_of(lease: LeaseState | None, own: str) -> list[dict[str, Any]]:
    """Return everybody: name, role, node of the window, whether that has the robot, whether it is this page.

    Args:
        own: Node of this page's window.
    """
    if lease is None:
        return []
    found = []
    for shown, node in lease.present:
        name, _, role = shown.rpartition(" (")
        found.append(
            {
                "name": name or shown,
                "role": role.rstrip(")"),
                "window": node,
                "pilot": node == lease.window,
                "me": node == own,
            }
        )
    return found


class PeopleReport:
    """Adds who is in to the states of one page: when it changes, and now and then."""

    def __init__(self) -> None:
        self._sent: list[dict[str, Any]] | None = None
        self._sent_at = -math.inf

    def add(self, people: list[dict[str, Any]], now: float) -> dict[str, Any]:
        """Return what belongs in the state at `now` [s]."""
        if people == self._sent and now - self._sent_at < PERIOD:
            return {}
        self._sent, self._sent_at = people, now
        return {"people": people}
