"""Replies of NAOqi as the types that were asked for. Every reader raises `UnexpectedReply` for anything else.

What arrives is whatever the other side sent: another type, a list of millions, values within values, NaN. NAOqi sends
none of these; whoever answers in its place may.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from telepresence.security.outside_text import clean

MOST_PARTS = 20_000
"""Values in a reply, those within others counted too; the longest of NAOqi's has a few hundred."""
DEEPEST = 16
"""Lists within lists."""
LARGEST = 1e9
"""Largest size of a number that is measured, in whatever unit."""
ERROR_LENGTH = 160
"""Characters of an error's text that the robot has a say in."""
_NAME = re.compile(r"[A-Za-z0-9_./:-]{1,80}")


class RobotError(Exception):
    """A call to the robot brought no result; the text is one short line."""


class CallRefused(RobotError):
    """The robot answered that it will not or cannot do what was asked."""


class UnexpectedReply(CallRefused):
    """The robot answered, but not with what was asked for; none of it is used."""


def bounded(value: Any, name: str) -> Any:
    """Return the reply to `name` if it is no larger and no deeper than NAOqi's are."""
    waiting, parts = [(value, 1)], 0
    while waiting:
        inner, depth = waiting.pop()
        if isinstance(inner, dict):
            inner = [*inner.keys(), *inner.values()] if len(inner) <= MOST_PARTS else range(MOST_PARTS + 1)
        elif not isinstance(inner, list | tuple):
            continue
        parts += len(inner)
        if parts > MOST_PARTS or depth > DEEPEST:
            raise UnexpectedReply(f"{name}: the reply holds more than {MOST_PARTS} values, or too many within others")
        waiting += [(part, depth + 1) for part in inner if isinstance(part, list | tuple | dict)]
    return value


def as_number(value: object) -> float:
    """Return a value of ALMemory as a float; NaN for None and for what nothing can have measured."""
    return float(value) if isinstance(value, int | float) and -LARGEST <= value <= LARGEST else math.nan


def number(value: object, name: str) -> float:
    """Return a number, finite and no larger than `LARGEST`."""
    found = as_number(value)
    if math.isnan(found):
        raise UnexpectedReply(f"{name}: {kind(value)} for a number")
    return found


def numbers(value: object, count: int, name: str) -> list[float]:
    """Return `count` numbers, each as `number` has it."""
    return [number(part, name) for part in sequence(value, name, count)]


def sequence(value: object, name: str, count: int | None = None) -> Sequence[Any]:
    """Return a list, of `count` values unless that is None."""
    if not isinstance(value, list | tuple) or count not in (None, len(value)):
        wanted = "a list" if count is None else f"{count} values"
        raise UnexpectedReply(f"{name}: {kind(value)} for {wanted}")
    return value


def flag(value: object, name: str) -> bool:
    """Return true or false; a number counts as what C makes of it."""
    if not isinstance(value, int):
        raise UnexpectedReply(f"{name}: {kind(value)} for true or false")
    return bool(value)


def text(value: object, name: str, longest: int = ERROR_LENGTH) -> str:
    """Return a text, cleaned and cut to `longest` characters."""
    if not isinstance(value, str):
        raise UnexpectedReply(f"{name}: {kind(value)} for a text")
    return clean(value, longest)


def names(value: object, most: int, name: str) -> list[str]:
    """Return at most `most` names as NAOqi has them: letters, digits, `_./:-`."""
    found = sequence(value, name)
    if len(found) > most or not all(isinstance(part, str) and _NAME.fullmatch(part) for part in found):
        raise UnexpectedReply(f"{name}: {kind(value)} for at most {most} names")
    return [str(part) for part in found]


def kind(value: object) -> str:
    """What a value is, in a few words, however large it is."""
    if isinstance(value, list | tuple | dict | bytes | bytearray):
        return f"{type(value).__name__} of {len(value)}"
    return clean(repr(value), 40) if value is None or isinstance(value, int | float) else type(value).__name__
