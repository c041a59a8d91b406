"""What a browser sends on its channels, checked. JSON, because the page is JavaScript.

    drive   {"n": 17, "t": 12.35, "v": [0.2, 0.0, 0.0], "hold": ""}     20 a second while something is held, else 4
    ask     {"id": 3, "do": "take", "to": ""}                           answered by {"id": 3, "ok": true, "text": ""}

`n` counts up, `t` is the browser's own clock [s], `v` forward, left [m/s] and counter-clockwise [rad/s], or null while
nothing is held; `hold` says why nobody should drive by this page now.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from telepresence.geometry import Velocity
from telepresence.teleop.lease_messages import MOST_TEXT

LONGEST = 1200
"""Bytes of a message: one packet."""
FASTEST, FASTEST_TURN = 2.0, 6.0
"""Faster than any robot here [m/s, rad/s]: whatever asks for more is no pilot's page. Safety gates limit the rest."""
REQUESTS = ("take", "release", "give", "keep", "stop", "reset_stop")
_MOST_NUMBER = 2**53
"""Larger ones are not exact in JavaScript."""


class BadMessage(ValueError):
    """What came is no message of the page; the text says why."""


@dataclass(frozen=True)
class DriveMessage:
    """A velocity, or a sign of life.

    Args:
        sent: The browser's own clock [s].
    """

    number: int
    sent: float
    velocity: Velocity | None
    hold: str


@dataclass(frozen=True)
class AskMessage:
    """A request, see `telepresence.teleop.drive_lease.DriveLease.ask`."""

    number: int
    action: str
    to: str


def parse_drive(text: str | bytes) -> DriveMessage:
    """Return what a message of the channel `drive` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"n", "t", "v", "hold"})
    return DriveMessage(_number(fields, "n"), _finite(fields["t"], "t"), _velocity(fields["v"]), _text(fields, "hold"))


def parse_ask(text: str | bytes) -> AskMessage:
    """Return what a message of the channel `ask` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"id", "do", "to"})
    action = _text(fields, "do")
    if action not in REQUESTS:
        raise BadMessage(f"there is no {action[:40]!r}; there are {', '.join(REQUESTS)}")
    return AskMessage(_number(fields, "id"), action, _text(fields, "to"))


def _fields(text: str | bytes, names: set[str]) -> dict[str, Any]:
    if not isinstance(text, str) or len(text) > LONGEST:
        raise BadMessage(f"it is no text of at most {LONGEST} characters")
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadMessage(f"it is no JSON: {str(error)[:80]}") from None
    if not isinstance(fields, dict) or set(fields) != names:
        raise BadMessage(f"it must have {', '.join(sorted(names))}, and nothing else")
    return fields


def _number(fields: dict[str, Any], name: str) -> int:
    value = fields[name]
    if type(value) is not int or not 0 < value < _MOST_NUMBER:
        raise BadMessage(f"{name} must be a whole number above 0")
    return value


def _finite(value: Any, name: str) -> float:
    if type(value) not in (int, float) or not abs(value) < _MOST_NUMBER or not math.isfinite(value):
        raise BadMessage(f"{name} must be a finite number")
    return float(value)


def _velocity(value: Any) -> Velocity | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 3:
        raise BadMessage("v must be three numbers, or null")
    velocity = Velocity(*(_finite(part, "v") for part in value))
    if math.hypot(velocity[0], velocity[1]) > FASTEST or abs(velocity[2]) > FASTEST_TURN:
        raise BadMessage("v is faster than any robot")
    return velocity


def _text(fields: dict[str, Any], name: str) -> str:
    value = fields[name]
    if not isinstance(value, str) or len(value) > MOST_TEXT or not value.isprintable():
        raise BadMessage(f"{name} must be at most {MOST_TEXT} printable characters")
    return value
