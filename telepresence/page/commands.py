"""What a browser sends on its channels, checked. JSON, because the page is JavaScript.

    drive   {"n": 17, "t": 12.35, "v": [0.2, 0.0, 0.0], "hold": ""}     20 a second while something is held, else 4
    floor   {"n": 18, "t": 12.4, "at": [0.4, 0.8], "press": 2, "stamp": 1.7e9, "speed": 0.2, "hold": ""}    in its place
    look    {"n": 4, "t": 12.35, "do": "goal", "at": [0.5, 0.1]}        20 a second while somebody looks around
    ask     {"id": 3, "do": "give", "with": "ben"}                      answered by {"id": 3, "ok": true, "text": ""}

`n` counts up, `t` is the browser's own clock [s], `v` forward, left [m/s] and counter-clockwise [rad/s], or null while
nothing is held; `hold` says why nobody should drive by this page now. `floor` is sent while somebody holds a place in
the picture: `at` are shares of it from its left and top, `press` counts the presses, `stamp` is when the picture was
taken [s since 1970] or null for the newest one, `speed` [m/s] is the greatest. `do` is a manner of looking in small
letters, see `telepresence.teleop.looking`, `at` its yaw and pitch, or null. What can be asked for stands in `REQUESTS`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from telepresence.geometry import Velocity
from telepresence.teleop.lease_messages import MOST_TEXT
from telepresence.teleop.looking import Look, Manner

LONGEST = 1200
"""Bytes of a message: one packet."""
FASTEST, FASTEST_TURN = 2.0, 6.0
"""Faster than any robot here [m/s, rad/s]: whatever asks for more is no pilot's page. Safety gates limit the rest."""
FARTHEST = math.pi
"""More than any head turns [rad, rad/s]; its driver knows how far it does."""
_MANNERS = {manner.name.lower(): manner for manner in Manner}
_AIMED = (Manner.RATE, Manner.GOAL)
"""Those that are made with angles."""
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
class FloorMessage:
    """A place in the picture that is held: the robot is to go there.

    Args:
        sent: The browser's own clock [s].
        at: Shares of the picture, from its left and from its top.
        press: Counts the presses: another one begins a drive of its own.
        stamp: When the picture was taken [s since 1970]; None for the newest one.
        speed: The greatest [m/s].
    """

    number: int
    sent: float
    at: tuple[float, float]
    press: int
    stamp: float | None
    speed: float
    hold: str


@dataclass(frozen=True)
class LookMessage:
    """Where somebody wants to look.

    Args:
        sent: The browser's own clock [s].
    """

    number: int
    sent: float
    look: Look


@dataclass(frozen=True)
class AskMessage:
    """A request: a row of `REQUESTS`, and what it is made with."""

    number: int
    action: str
    value: Any


class Who(Enum):
    """Who may make a request."""

    LEASE = "drive_lease decides"
    DRIVER = "who has the robot"
    EVERYBODY = "whoever has signed in"
    CONNECTION = "everybody, of the own connection"


@dataclass(frozen=True)
class Request:
    """One thing that a page can ask for.

    Args:
        read: Returns what the request is made with, checked. Raises BadMessage.
    """

    who: Who
    read: Callable[[Any], Any]


def parse_drive(text: str | bytes) -> DriveMessage:
    """Return what a message of the channel `drive` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"n", "t", "v", "hold"})
    return DriveMessage(
        _number(fields, "n"), read_finite(fields["t"]), _velocity(fields["v"]), read_text(fields["hold"])
    )


def parse_floor(text: str | bytes) -> FloorMessage:
    """Return what a message of the channel `floor` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"n", "t", "at", "press", "stamp", "speed", "hold"})
    at, stamp, speed = fields["at"], fields["stamp"], read_finite(fields["speed"])
    if not isinstance(at, list) or len(at) != 2 or not all(0.0 <= read_finite(part) <= 1.0 for part in at):
        raise BadMessage("at must be two shares, 0 to 1")
    if not 0.0 <= speed <= FASTEST:
        raise BadMessage(f"speed must be 0 to {FASTEST:g} m/s")
    return FloorMessage(
        _number(fields, "n"),
        read_finite(fields["t"]),
        (float(at[0]), float(at[1])),
        _number(fields, "press"),
        None if stamp is None else read_finite(stamp),
        speed,
        read_text(fields["hold"]),
    )


def parse_look(text: str | bytes) -> LookMessage:
    """Return what a message of the channel `look` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"n", "t", "do", "at"})
    manner = _MANNERS.get(read_text(fields["do"]))
    if manner is None:
        raise BadMessage(f"do must be one of {', '.join(_MANNERS)}")
    return LookMessage(_number(fields, "n"), read_finite(fields["t"]), Look(manner, *_aim(fields["at"], manner)))


def parse_ask(text: str | bytes) -> AskMessage:
    """Return what a message of the channel `ask` says.

    Raises:
        BadMessage: It says nothing, or something that no page of ours says.
    """
    fields = _fields(text, {"id", "do", "with"})
    action = read_text(fields["do"])
    if action not in REQUESTS:
        raise BadMessage(f"there is no {action[:40]!r}; there are {', '.join(REQUESTS)}")
    return AskMessage(_number(fields, "id"), action, REQUESTS[action].read(fields["with"]))


def read_text(value: Any) -> str:
    """Return one line of text. Raises BadMessage."""
    if not isinstance(value, str) or len(value) > MOST_TEXT or not value.isprintable():
        raise BadMessage(f"it must have at most {MOST_TEXT} printable characters")
    return value


def read_finite(value: Any) -> float:
    """Return a number. Raises BadMessage."""
    if type(value) not in (int, float) or not abs(value) < _MOST_NUMBER or not math.isfinite(value):
        raise BadMessage("it must be a finite number")
    return float(value)


def read_nothing(value: Any) -> None:
    """Let null pass. Raises BadMessage."""
    if value is not None:
        raise BadMessage("'with' must be null")


def read_flag(value: Any) -> bool:
    """Return true or false. Raises BadMessage."""
    if not isinstance(value, bool):
        raise BadMessage("it is made with true or false")
    return value


REQUESTS = {
    "take": Request(Who.LEASE, read_nothing),
    "release": Request(Who.LEASE, read_nothing),
    "give": Request(Who.LEASE, read_text),
    "keep": Request(Who.LEASE, read_nothing),
    "stop": Request(Who.LEASE, read_nothing),
    "reset_stop": Request(Who.LEASE, read_nothing),
    "small_picture": Request(Who.CONNECTION, read_flag),
    "listen": Request(Who.EVERYBODY, read_flag),
    "face": Request(Who.DRIVER, read_flag),
    "say": Request(Who.DRIVER, read_text),
}
"""Name -> who may make the request, and with what."""


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


def _velocity(value: Any) -> Velocity | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 3:
        raise BadMessage("v must be three numbers, or null")
    velocity = Velocity(*(read_finite(part) for part in value))
    if math.hypot(velocity[0], velocity[1]) > FASTEST or abs(velocity[2]) > FASTEST_TURN:
        raise BadMessage("v is faster than any robot")
    return velocity


def _aim(value: Any, manner: Manner) -> tuple[float, ...]:
    if manner not in _AIMED:
        read_nothing(value)
        return ()
    if not isinstance(value, list) or len(value) != 2:
        raise BadMessage("at must be two numbers")
    aim = tuple(read_finite(part) for part in value)
    if max(map(abs, aim)) > FARTHEST:
        raise BadMessage("at is farther than any head turns")
    return aim
