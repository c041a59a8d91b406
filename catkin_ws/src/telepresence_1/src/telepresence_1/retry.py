"""When to try again what others may undo at once."""

from __future__ import annotations

CALM = 60.0
"""Seconds without an attempt after which the pauses begin short again."""


class Retry:
    """Pauses that double from `first` to `longest` [s], so that two programs that want the same do not fight."""

    def __init__(self, first: float, longest: float) -> None:
        self._first, self._longest = first, longest
        self._pause = first
        self._last = self._next = float("-inf")

    def due(self, now: float) -> bool:
        """Whether an attempt may be made `now` [s, monotonic]; it then counts as made."""
        if now < self._next:
            return False
        if now - self._last > CALM:
            self._pause = self._first
        self._last, self._next = now, now + self._pause
        self._pause = min(2 * self._pause, self._longest)
        return True
