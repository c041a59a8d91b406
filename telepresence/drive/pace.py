# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004
"""How often commands may go out: one in a period on average, but a few at once when there was a pause before."""

from telepresence.drive.datagram import INFINITY


class Pace(object):
    """No clock in it: times are arguments [s].

    Args:
        period: Seconds for each on average.
        burst: How many may follow each other at once.
    """

    def __init__(self, period, burst):
        # type: (float, int) -> None
        self._period, self._ahead = period, (burst - 1) * period
        self._paid_until = -INFINITY

    def due(self):
        # type: () -> float
        """When the next one may go out."""
        return self._paid_until - self._ahead

    def take(self, now):
        # type: (float) -> None
        """One goes out `now`."""
        self._paid_until = max(self._paid_until, now) + self._period
