"""A log that nobody can flood: what strangers cause over and over is written once a second, and counted."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

BURST = 8
"""Lines of one logger that are written at once, as programs write when they begin."""
PERIOD = 1.0
"""Seconds per line of one logger from then on."""
MAX_LINE = 400
"""Characters of a message; what outsiders send may be in it."""


class LogFlood(logging.Filter):
    """Lets each logger write `BURST` lines, and one in each `PERIOD` after that, which says how many were left out.

    Tracebacks are left out with them. To be added to a handler.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._budgets: dict[str, _Budget] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the record is written."""
        budget = self._budgets.setdefault(record.name, _Budget(self._clock()))
        left_out = budget.spend(self._clock())
        if left_out is None:
            return False
        text = "".join(each if each.isprintable() else " " for each in record.getMessage())[:MAX_LINE]
        record.msg = f"{text} (and {left_out} lines that are left out)" if left_out else text
        record.args = None
        return True


class _Budget:
    def __init__(self, now: float) -> None:
        self._lines, self._since, self._left_out = float(BURST), now, 0

    def spend(self, now: float) -> int | None:
        """How many lines were left out since the last one that was written; None: this one is, too."""
        self._lines, self._since = min(BURST, self._lines + (now - self._since) / PERIOD), now
        if self._lines < 1.0:
            self._left_out += 1
            return None
        self._lines -= 1.0
        left_out, self._left_out = self._left_out, 0
        return left_out
