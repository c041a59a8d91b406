"""When a program that died starts again: at once, and later and later when it dies again and again."""

from __future__ import annotations

STEADY_AFTER = 3.0
"""Seconds after which a program that started counts as running well."""
FIRST_PAUSE = 0.5
"""Seconds before the third start in a row; each further pause is twice as long."""
LONGEST_PAUSE = 2.0
"""Seconds between two starts at most: whoever can come back is back within three seconds, also after many deaths."""


class Restarts:
    """The pauses of one program. `now` is monotonic time [s]."""

    def __init__(self) -> None:
        self._started = 0.0
        self.quick_deaths = 0
        """How often in a row it died without having run well."""

    def started(self, now: float) -> None:
        """It starts now."""
        self._started = now

    def died(self, now: float, ready: bool = True) -> float:
        """It died now. Return the seconds after which it shall start again.

        Args:
            ready: Whether it ever did what it is for; what never did has not run well, however long it tried.
        """
        steady = ready and now - self._started > STEADY_AFTER
        self.quick_deaths = 0 if steady else self.quick_deaths + 1
        if self.quick_deaths < 2:
            return 0.0
        return min(FIRST_PAUSE * 2.0 ** min(self.quick_deaths - 2, 10), LONGEST_PAUSE)

    @property
    def worth_a_line(self) -> bool:
        """Whether the last death belongs in the log: for a program that keeps dying two lines are enough."""
        return self.quick_deaths <= 2


def what_next(pause: float) -> str:
    """Return in words what comes after a death: "starts again", "starts again in 2 s"."""
    return f"starts again in {pause:g} s" if pause else "starts again"
