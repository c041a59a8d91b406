"""Texts with instructions, as ALAnimatedSpeech says them: "Hello! ^start(animations/Stand/Gestures/Hey_1) $met=yes".

Source: NAOqi 2.8 documentation, ALAnimatedSpeech, Annotated text.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

_MARK = re.compile(r"\^(?P<instruction>[A-Za-z]\w*)\s*\(|\$(?P<event>[A-Za-z_][\w/]*)\s*=\s*(?P<value>[^\s^$]+)")
_CALL = re.compile(r"\s*(?P<service>\w+)\.(?P<method>\w+)\s*\((?P<arguments>.*)\)\s*", re.DOTALL)
_TRUTH = {"true": True, "false": False}


@dataclass(frozen=True)
class Words:
    """Words to be said."""

    text: str


@dataclass(frozen=True)
class Instruction:
    """^name(argument, ...)."""

    name: str
    arguments: tuple[str, ...]
    text: str
    """All between the brackets."""


@dataclass(frozen=True)
class Event:
    """$name=value: an event to be raised."""

    name: str
    value: str


def parse(text: str) -> list[Words | Instruction | Event]:
    """Split a text at its instructions. An instruction without its closing bracket is dropped."""
    return [item for item in _items(text) if not isinstance(item, Words) or item.text.strip()]


def parse_call(text: str) -> tuple[str, str, list[Any]]:
    """Parse "ALMotion.setAngles('HeadYaw', 0.5, 0.1)" to service, method and arguments.

    Raises: ValueError: It is no call.
    """
    match = _CALL.fullmatch(text)
    if match is None:
        raise ValueError(f"'{text[:60]}' is no call of a method")
    return match["service"], match["method"], _values(match["arguments"])


def _items(text: str) -> Iterator[Words | Instruction | Event]:
    position = 0
    unclosed: dict[int, int] | None = None
    while match := _MARK.search(text, position):
        yield Words(text[position : match.start()])
        if match["event"]:
            yield Event(match["event"], match["value"].strip("\"'"))
            position = match.end()
            continue
        # An instruction that does not close was read to the text's end: those inside it were seen on the way.
        closing = unclosed if unclosed is not None else _closing(text, match.end())
        end = closing.get(match.end())
        if end is None:
            unclosed = closing
            position = match.end()
            continue
        inside = text[match.end() : end]
        yield Instruction(match["instruction"], tuple(part.strip() for part in inside.split(",")), inside)
        position = end + 1
    yield Words(text[position:])


def _closing(text: str, start: int) -> dict[int, int]:
    """Return where the bracket whose inside begins at `start` closes, and each one within: inside's start -> end."""
    closing: dict[int, int] = {}
    open_, quote = [start], ""
    for index in range(start, len(text)):
        letter = text[index]
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'" and len(open_) > 1:
            quote = letter
        elif letter == "(":
            open_.append(index + 1)
        elif letter == ")":
            closing[open_.pop()] = index
            if not open_:
                break
    return closing


def _values(text: str) -> list[Any]:
    """Return arguments: Python's literals, true and false, and words without quotes as text."""
    if not text.strip():
        return []
    try:
        return list(ast.literal_eval(f"[{text}]"))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return [_value(part.strip()) for part in text.split(",")]


def _value(text: str) -> Any:
    if text.lower() in _TRUTH:
        return _TRUTH[text.lower()]
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return text
