"""Text that comes from outside (a robot, a message, a file's name) on its way to a screen, a terminal, a log or a page.

It is cleaned once, where it enters: what is shown later is what Python calls printable, in one line, of bounded length.
So it can neither move a terminal's cursor, nor hide or turn round what stands beside it, nor fill memory. It may still
hold `<` and `&`: whoever writes HTML escapes it, and the window's labels show plain text (`gui.widgets.label`).
"""

from __future__ import annotations

import logging
import unicodedata
from types import TracebackType
from typing import Any

LONGEST = 300
"""Characters of a sentence."""
LONGEST_NAME = 60
"""Characters of a name: of a pilot, a node, a frame, a device."""
LONGEST_LOG = 2000
"""Characters of a line in a log."""
LONGEST_TRACEBACK = 20_000
"""Characters of a traceback, its line ends kept."""
UNKNOWN = "\ufffd"
"""Stands for each control character, so that one sees that something was there."""
MORE = "…"


def clean(text: object, longest: int = LONGEST, lines: bool = False) -> str:
    """Return `text` without control characters, directions of writing and unpaired surrogates, `longest` characters at
    most, the last of which is an ellipsis if something was cut off. Printable text of that length stays as it is.

    Args:
        text: Anything that `str` makes text of.
        lines: Keep line ends; else they become spaces like all other space.
    """
    text = str(text)
    if len(text) > longest:
        text = text[: longest - 1] + MORE
    if text.isprintable():
        return text
    return "".join(map(_shown_with_lines if lines else _shown, text))


def clean_name(text: object) -> str:
    """Return `clean` of a name."""
    return clean(text, LONGEST_NAME)


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    if character.isspace():
        return " "
    # Formats (Cf) are invisible: directions of writing, joiners, byte order marks.
    return "" if unicodedata.category(character) == "Cf" else UNKNOWN


def _shown_with_lines(character: str) -> str:
    return character if character == "\n" else _shown(character)


class PlainRecord(logging.LogRecord):
    """A log record whose message and traceback are clean, whichever handler writes it.

    That of ROS also looks in the message for fields like ${time:%H}, and fails at one without an end.
    """

    def __init__(
        self,
        name: str,
        level: int,
        pathname: str,
        lineno: int,
        msg: object,
        args: Any,
        exc_info: tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None] | None,
        func: str | None = None,
        sinfo: str | None = None,
        **more: Any,
    ) -> None:
        super().__init__(name, level, pathname, lineno, msg, args, exc_info, func, sinfo, **more)
        if exc_info and exc_info[0] is not None:
            # A handler's formatter takes the text that is there already.
            self.exc_text = _logged(logging.Formatter().formatException(exc_info), LONGEST_TRACEBACK)

    def getMessage(self) -> str:
        return _logged(super().getMessage(), LONGEST_LOG)


def _logged(text: str, longest: int) -> str:
    return clean(text, longest, lines=True).replace("${", "$ {")


def keep_logs_plain() -> None:
    """Have every log line of this process written plainly from now on."""
    logging.setLogRecordFactory(PlainRecord)
