"""Errors that no code expects. PyQt would end the process at the first one, which one odd message could bring about
whenever it likes; so the window writes them down, and goes on.
"""

from __future__ import annotations

import logging
import sys
import time
from types import TracebackType

log = logging.getLogger(__name__)

PERIOD = 1.0
"""[s] between two tracebacks: what fails while the window is painted fails each time."""


class UnexpectedErrors:
    """Logs exceptions that nobody catches, one a second at most."""

    def __init__(self) -> None:
        self._logged = -PERIOD
        self._hidden = 0

    def log_all(self) -> None:
        """Log them from now on."""
        sys.excepthook = self._on_exception

    def _on_exception(self, kind: type[BaseException], error: BaseException, traceback: TracebackType | None) -> None:
        now = time.monotonic()
        if now - self._logged < PERIOD:
            self._hidden += 1
            return
        log.error("the window failed at something (%d more since the last time)", self._hidden,
                  exc_info=(kind, error, traceback))  # fmt: skip
        self._logged, self._hidden = now, 0
