"""When to play what arrives unevenly."""

from __future__ import annotations

_PULL = 0.05
"""Share of a piece's lateness that moves the schedule: follows the sender's clock, not single late pieces."""


class Schedule:
    """Places pieces of sound one after the other.

    Args:
        lead: Seconds that a piece waits when it arrives on time: what the next one may be late without a gap.
        most: Seconds that it may wait at most; what would wait longer, after a pause, is dropped.
    """

    def __init__(self, lead: float, most: float) -> None:
        self._lead, self._most = lead, most
        self._due: float | None = None

    def place(self, arrival: float, duration: float) -> tuple[float | None, bool]:
        """The moment to play a piece [s], None when it is to be dropped; and whether there is a seam before it."""
        wanted = arrival + self._lead
        seam = self._due is None or self._due < arrival
        due = wanted if seam else self._due + _PULL * (wanted - self._due)
        if due > arrival + self._most:
            return None, False
        self._due = due + duration
        return due, seam

    def forget(self) -> None:
        """Begin anew with the next piece."""
        self._due = None
