"""The logging functions of the vendor's package, on Python's own logging.

`logging.warning("category", "text", value)` goes to the standard logger `telepresence.naoqi.category`; a program that
configures no handlers gets one line on standard error.
"""

from __future__ import annotations

import enum
import logging as standard
from typing import Any

from .log import ROOT, logger

LogLevel = enum.IntEnum(
    "LogLevel", {"Silent": 0, "Fatal": 1, "Error": 2, "Warning": 3, "Info": 4, "Verbose": 5, "Debug": 6}
)
SILENT, FATAL, ERROR, WARNING, INFO, VERBOSE, DEBUG = LogLevel

_VERBOSE_LEVEL = standard.DEBUG + 5
_LEVELS = {
    SILENT: standard.CRITICAL + 10,
    FATAL: standard.CRITICAL,
    ERROR: standard.ERROR,
    WARNING: standard.WARNING,
    INFO: standard.INFO,
    VERBOSE: _VERBOSE_LEVEL,
    DEBUG: standard.DEBUG,
}


def setLevel(level: int) -> None:
    """Show messages of this level and graver ones; the package's own too."""
    ROOT.setLevel(_LEVELS[LogLevel(int(level))])


def setFilters(filters: str) -> None:
    """Set levels by category: "qi.a=4:qi.b=2". RuntimeError: it is not of that form."""
    for item in filter(None, filters.split(":")):
        category, separator, level = item.partition("=")
        if not separator or not level.isdigit() or int(level) > int(DEBUG):
            raise RuntimeError(f"Invalid filter: {item!r} is not category=level, with a level of 0 to 6")
        logger(category).setLevel(_LEVELS[LogLevel(int(level))])


def setContext(context: int) -> None:
    """Accepted and without effect: what a line shows is up to the handlers of Python's logging."""


def _write(level: int, category: str, mess: Any, args: tuple[Any, ...]) -> None:
    text = " ".join(str(part) for part in (mess, *args))
    logger(category).log(_LEVELS[LogLevel(level)], "%s", text, stacklevel=3)


class Logger:
    """A logger of one category. Messages are put together as by `print`."""

    def __init__(self, category: str) -> None:
        self.category = category

    def fatal(self, mess: Any, *args: Any) -> None:
        """Log a message of level FATAL."""
        _write(FATAL, self.category, mess, args)

    def error(self, mess: Any, *args: Any) -> None:
        """Log a message of level ERROR."""
        _write(ERROR, self.category, mess, args)

    def warning(self, mess: Any, *args: Any) -> None:
        """Log a message of level WARNING."""
        _write(WARNING, self.category, mess, args)

    def info(self, mess: Any, *args: Any) -> None:
        """Log a message of level INFO."""
        _write(INFO, self.category, mess, args)

    def verbose(self, mess: Any, *args: Any) -> None:
        """Log a message of level VERBOSE."""
        _write(VERBOSE, self.category, mess, args)


def fatal(cat: str, mess: Any, *args: Any) -> None:
    """Log a message of level FATAL."""
    _write(FATAL, cat, mess, args)


def error(cat: str, mess: Any, *args: Any) -> None:
    """Log a message of level ERROR."""
    _write(ERROR, cat, mess, args)


def warning(cat: str, mess: Any, *args: Any) -> None:
    """Log a message of level WARNING."""
    _write(WARNING, cat, mess, args)


def info(cat: str, mess: Any, *args: Any) -> None:
    """Log a message of level INFO."""
    _write(INFO, cat, mess, args)


def verbose(cat: str, mess: Any, *args: Any) -> None:
    """Log a message of level VERBOSE."""
    _write(VERBOSE, cat, mess, args)


ROOT.setLevel(standard.INFO)
standard.addLevelName(_VERBOSE_LEVEL, "VERBOSE")
