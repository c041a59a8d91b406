"""The package's own messages: standard logging, and standard error in a program that has no handlers."""

from __future__ import annotations

import logging
import sys

ROOT_NAME = "telepresence.naoqi"
_LETTERS = {logging.DEBUG: "D", logging.INFO: "I", logging.WARNING: "W", logging.ERROR: "E", logging.CRITICAL: "F"}


class _PlainStderr(logging.Handler):
    """Write a line to standard error, as the vendor's package does, unless the program has handlers of its own."""

    def emit(self, record: logging.LogRecord) -> None:
        if logging.getLogger().handlers or sys.stderr is None:
            return
        letter = _LETTERS.get(record.levelno, "V")
        name = record.name[len(ROOT_NAME) + 1 :]
        try:
            sys.stderr.write(f"[{letter}] {record.created:.6f} {record.thread} {name}: {record.getMessage()}\n")
        except (OSError, ValueError):  # standard error is closed
            self.handleError(record)


ROOT = logging.getLogger(ROOT_NAME)
if not ROOT.handlers:
    ROOT.addHandler(_PlainStderr())


def logger(category: str) -> logging.Logger:
    """Return the logger of a part of the package, such as "session"."""
    return ROOT.getChild(category)
