"""When to play what arrives unevenly."""

from __future__ import annotations

_INERTIA = 4.0
"""Seconds over which lateness is averaged: the schedule follows the sender's clock, not single late pieces."""


class Schedule:
    """Places pieces of sound one after the other.

    Args:
        lead: Seconds that a piece waits when it arrives on time: what the next one may be late without a gap.
        most: Seconds that it may wait at most; what would wait longer, after a pause, is dropped.
        settle: Seconds of sound after a beginning that are dropped while the earliest arrival is looked for. Who
            receives the pieces may keep the pace of the first one for minutes, and it may have been a late one.
    """

    def __init__(self, lead: float, most: float, settle: float = 0.0) -> None:
        self._lead, self._most, self._settle = lead, most, settle
        self._due: float | None = None
        self._settling = settle

    def place(self, arrival: float, duration: float) -> tuple[float | None, bool]:
        """The moment to play a piece [s], None when it is to be dropped; and whether there is a seam before it."""
        wanted = arrival + self._lead
        last = self._due
        if last is None or last < arrival:
            due, seam = wanted, True
        else:
            due, seam = last + min(1.0, duration / _INERTIA) * (wanted - last), False
        if due > arrival + self._most:
            return None, False
        if self._settling > 0.0:
            self._settling -= duration
            self._due = min(due, wanted) + duration
            return None, False
        self._due = due + duration
        return due, seam

    def forget(self) -> None:
        """Begin anew with the next piece."""
        self._due, self._settling = None, self._settle
