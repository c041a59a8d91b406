"""What pilot and drive server say to each other: bodies of JSON in the signed datagrams of
`telepresence.drive.session`, over UDP. No ROS, no socket.

    robot -> pilot  {"type": "welcome"}                      the session is open
    pilot -> robot  {"type": "drive", "echo": T, "after": A, "velocity": [vx, vy, wz] or null, "careful": bool,
                     "goal": {"id": K, "pose": [x, y, theta]} or null}    20 times a second
    robot -> pilot  {"type": "report", "stamp": T, "seq": N, ...}        what was let through, and why; as often
    pilot -> robot  {"type": "ask", "id": K, "what": "stop" | "reset stop" | "reset bumper" | "leave"}
    robot -> pilot  {"type": "done", "id": K, "ok": bool, "text": "..."}
    robot -> pilot  {"type": "refused", "text": "..."}       a sentence for people

Datagrams, because nothing may queue: over a connection every old command arrives after an outage, seconds late. The
session's number says which command is newer. Its age is known without a common clock: a report carries the robot's time
T, and a command says which report was the last one received and how long after it the pilot gave the command (A [s];
negative if before). So at the robot's time t its age is at most t - T - A, the network's delays both ways included. A
pilot who does not receive the robot's reports cannot drive it, and neither can somebody who does not see its answers.

A goal is a pose relative to the robot when it first arrives [m, m, rad]. It ends when it is no longer repeated, and a
velocity beats it. A robot that has no way of its own to a goal ignores it.
"""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple

from telepresence.geometry import Velocity

DEFAULT_PORT = 8082
MAX_DATAGRAM = 1400
"""Bytes; fits an Ethernet frame, so nothing is lost in pieces."""
PERIOD = 0.05
"""Seconds between two commands, and between two reports."""
REQUESTS = ("stop", "reset stop", "reset bumper", "leave")
LARGEST = 1e9
"""Largest size of any number in a datagram."""
SECTORS = 72
"""Directions of `Report.allowed`: 5 degrees each, the first one ahead, to the left."""
MAX_TEXT = 300
"""Bytes of a sentence; more would not fit one datagram."""


DRIVING, REACHED, ENDED = GOAL_STATES = ("driving", "reached", "ended")


class BadMessage(ValueError):
    """A datagram that is none of ours, or holds what cannot be used; the text says what."""


class Goal(NamedTuple):
    """A pose relative to the robot when it first arrived [m, m, rad]; `number` is the pilot's."""

    number: int
    pose: tuple[float, float, float]


class GoalState(NamedTuple):
    """What became of goal `number`: one of `GOAL_STATES`."""

    number: int
    state: str


class Drive(NamedTuple):
    """A velocity of base_link [m/s, m/s, rad/s], None for no command; see above for the rest."""

    echo: float
    after: float
    velocity: tuple[float, float, float] | None
    careful: bool
    goal: Goal | None = None


class Ask(NamedTuple):
    """A request that is answered; `number` is the pilot's, repeated until the answer comes."""

    number: int
    what: str


class Report(NamedTuple):
    """What the drive server lets through: `telepresence.safety.Decision` on the wire.

    `gap` [m] and `command_age` [s] may be infinite; `sector` is -1 for none; `given` is what was sent to the base
    [m/s, m/s, rad/s]; `stamp` is the robot's clock [s]. `allowed` is empty where no sensor gate runs at that end.
    """

    stamp: float
    seq: int
    state: str
    reason: str
    given: tuple[float, float, float]
    allowed: tuple[float, ...]
    gap: float
    sector: int
    command_age: float
    scanning: bool
    goal: GoalState | None = None


def encode(**fields: Any) -> bytes:
    """A body of these fields. Infinity goes as null."""
    return _ENCODER.encode({name: _sendable(value) for name, value in fields.items()}).encode()


def encode_report(report: Report) -> bytes:
    """A report's body; it always fits a datagram."""
    fields = report._asdict()
    fields["reason"] = short(report.reason)
    # In whole cm/s: written in a third of the time that it takes to write floats.
    fields["allowed"] = [round(speed * 100.0) for speed in report.allowed]
    fields["given"] = [round(part, 4) for part in report.given]
    for name in ("gap", "command_age"):
        fields[name] = round(fields[name], 3) if math.isfinite(fields[name]) else None
    fields["goal"] = report.goal and {"id": report.goal.number, "state": report.goal.state}
    return encode(type="report", **fields)


def decode(body: bytes) -> dict[str, Any]:
    """The fields of a body.

    Raises:
        BadMessage: It is not a JSON object of ours.
    """
    if len(body) > MAX_DATAGRAM:
        raise BadMessage(f"longer than {MAX_DATAGRAM} bytes")
    try:
        fields = _DECODER.decode(body.decode())
    except (ValueError, RecursionError) as error:
        raise BadMessage(str(error) if isinstance(error, BadMessage) else "not JSON") from None
    if not isinstance(fields, dict) or not isinstance(fields.get("type"), str):
        raise BadMessage("not an object with a type")
    return fields


def parse_for_robot(body: bytes) -> Drive | Ask:
    """What a pilot sent.

    Raises:
        BadMessage: It cannot be understood, or holds a number that is not finite.
    """
    fields = decode(body)
    match fields["type"]:
        case "drive":
            velocity = fields.get("velocity")
            return Drive(
                _number(fields, "echo"),
                _number(fields, "after"),
                None if velocity is None else _velocity(fields, "velocity"),
                _flag(fields, "careful"),
                _goal(fields),
            )
        case "ask":
            what = _text(fields, "what")
            if what not in REQUESTS:
                raise BadMessage(f"there is no request {what!r}; requests: {', '.join(REQUESTS)}")
            return Ask(_whole(fields, "id"), what)
    raise BadMessage(f"{fields['type']!r} is not what a pilot sends")


def parse_report(fields: dict[str, Any]) -> Report:
    """A report of the robot, from `decode`.

    Raises:
        BadMessage: It is not one.
    """
    return Report(
        _number(fields, "stamp"),
        _whole(fields, "seq"),
        printable(_text(fields, "state")),
        printable(_text(fields, "reason")),
        _velocity(fields, "given"),
        tuple(speed / 100.0 for speed in _numbers(fields, "allowed", SECTORS)) if fields.get("allowed") != [] else (),
        math.inf if fields.get("gap") is None else _number(fields, "gap"),
        _sector(fields),
        math.inf if fields.get("command_age") is None else _number(fields, "command_age"),
        _flag(fields, "scanning"),
        _goal_state(fields),
    )


def printable(text: str) -> str:
    """Text of the other side for a terminal or a window: control characters and the like become blanks."""
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


def short(text: str) -> str:
    """As much of a printable text as takes at most `MAX_TEXT` bytes on the wire."""
    text = printable(text[:MAX_TEXT])
    if text.isascii() and len(text) <= MAX_TEXT // 2:  # a quotation mark takes two
        return text
    while len(_ENCODER.encode(text).encode()) > MAX_TEXT + 2:
        text = text[: len(text) * 9 // 10]
    return text


def _sector(fields: dict[str, Any]) -> int:
    sector = _whole(fields, "sector")
    if not -1 <= sector < SECTORS:
        raise BadMessage("sector is out of range")
    return sector


def _refuse_constant(name: str) -> float:
    raise BadMessage(f"{name} is not a number that can be used")


# Made once: json.dumps and json.loads with options make a new one each time.
_ENCODER = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False)
_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


def _sendable(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _number(fields: dict[str, Any], name: str) -> float:
    return _finite(fields.get(name), name)


def _finite(value: Any, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadMessage(f"{name} is not a number")
    if not abs(value) <= LARGEST:  # catches what json makes of 1e999, and whole numbers no float can hold
        raise BadMessage(f"{name} is out of range")
    return float(value)


def _whole(fields: dict[str, Any], name: str) -> int:
    value = fields.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not abs(value) < 1 << 53:
        raise BadMessage(f"{name} is not a whole number")
    return value


def _numbers(fields: dict[str, Any], name: str, count: int) -> tuple[float, ...]:
    values = fields.get(name)
    if not isinstance(values, list) or len(values) != count:
        raise BadMessage(f"{name} is not a list of {count}")
    return tuple(_finite(value, name) for value in values)


def _three(fields: dict[str, Any], name: str) -> tuple[float, float, float]:
    first, second, third = _numbers(fields, name, 3)
    return first, second, third


def _velocity(fields: dict[str, Any], name: str) -> Velocity:
    return Velocity(*_three(fields, name))


def _goal(fields: dict[str, Any]) -> Goal | None:
    goal = _part(fields, "goal")
    return None if goal is None else Goal(_whole(goal, "id"), _three(goal, "pose"))


def _goal_state(fields: dict[str, Any]) -> GoalState | None:
    goal = _part(fields, "goal")
    if goal is None:
        return None
    if goal.get("state") not in GOAL_STATES:
        raise BadMessage("the goal has no state that is known")
    return GoalState(_whole(goal, "id"), goal["state"])


def _part(fields: dict[str, Any], name: str) -> dict[str, Any] | None:
    part = fields.get(name)
    if part is not None and not isinstance(part, dict):
        raise BadMessage(f"{name} is not an object")
    return part


def _text(fields: dict[str, Any], name: str) -> str:
    value = fields.get(name)
    if not isinstance(value, str) or len(value) > 400:
        raise BadMessage(f"{name} is not a short text")
    return value


def _flag(fields: dict[str, Any], name: str) -> bool:
    value = fields.get(name, False)
    if not isinstance(value, bool):
        raise BadMessage(f"{name} is neither true nor false")
    return value
