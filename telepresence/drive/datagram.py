# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP031
"""What pilot and drive server say to each other: bodies of JSON in the signed datagrams of
`telepresence.drive.session`, over UDP. No ROS, no socket.

    robot -> pilot  {"type": "welcome"}                      the session is open
    pilot -> robot  {"type": "drive", "echo": T, "after": A, "velocity": [vx, vy, wz] or null, "careful": bool,
                     "goal": {"id": K, "pose": [x, y, theta]} or null, "hard": bool}    20 times a second
    robot -> pilot  {"type": "report", "stamp": T, "seq": N, ...}        what was let through, and why; as often
    pilot -> robot  {"type": "ask", "id": K, "what": "stop" | "reset stop" | "reset bumper" | "leave"}
    robot -> pilot  {"type": "done", "id": K, "ok": bool, "text": "..."}
    robot -> pilot  {"type": "refused", "text": "..."}       a sentence for people

Datagrams, because nothing may queue: over a connection every old command arrives after an outage, seconds late. The
session's number says which command is newer. Its age is known without a common clock: a report carries the robot's time
T, and a command says which report was the last one received and how long after it the pilot gave the command (A [s];
negative if before). So at the robot's time t its age is at most t - T - A, the network's delays both ways included. A
pilot who does not receive the robot's reports cannot drive it, and neither can somebody who does not see its answers.

`hard` goes with no velocity and no goal: what gave them has failed, so brake as for a pilot who fell silent, at once.
A goal is a pose relative to the robot when it first arrives [m, m, rad]. It ends when it is no longer repeated, and a
velocity beats it. A robot that has no way of its own to a goal ignores it.
"""

import json
import unicodedata
from collections import namedtuple

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Optional, Tuple, Union  # noqa: F401, UP035

    Vector = tuple[float, float, float]

INFINITY = float("inf")
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


_VELOCITY = '{"type":"drive","echo":%r,"after":%r,"velocity":[%r,%r,%r],"careful":%s}'

DRIVING, REACHED, ENDED = GOAL_STATES = ("driving", "reached", "ended")


TEXT = type(b"".decode("ascii"))
"""What JSON has as text: str, in Python 2.7 unicode."""
WHOLE = (int, type(1 << 64))
"""What JSON has as whole numbers: int, in Python 2.7 long too."""
NUMBERS = (int, type(1 << 64), float)
PRINTABLE = getattr(TEXT, "isprintable", None)


class BadMessage(ValueError):
    """A datagram that is none of ours, or holds what cannot be used; the text says what."""


class Goal(namedtuple("Goal", "number pose")):
    """A pose relative to the robot when it first arrived [m, m, rad]; `number` is the pilot's."""

    __slots__ = ()


class GoalState(namedtuple("GoalState", "number state")):
    """What became of goal `number`: one of `GOAL_STATES`."""

    __slots__ = ()


class Drive(namedtuple("Drive", "echo after velocity careful goal hard")):
    """A velocity of base_link [m/s, m/s, rad/s], None for no command, or a goal, None for none; see above."""

    __slots__ = ()


class Ask(namedtuple("Ask", "number what")):
    """A request that is answered; `number` is the pilot's, repeated until the answer comes."""

    __slots__ = ()


class Report(namedtuple("Report", "stamp seq state reason given allowed gap sector command_age scanning goal started")):
    """What the drive server lets through: `telepresence.safety.Decision` on the wire.

    `gap` [m] and `command_age` [s] may be infinite; `sector` is -1 for none; `given` is what was sent to the base
    [m/s, m/s, rad/s]; `stamp` is the robot's clock [s]. `allowed` [m/s] is empty where no sensor gate runs at that end;
    `goal` is a `GoalState` or None. `started` is when the drive server began, on the clock of `stamp` [s]: a later one
    knows nothing of what an earlier one was asked for. None from an older program, which does not say it.
    """

    __slots__ = ()


def encode(**fields):
    # type: (**Any) -> bytes
    """A body of these fields. Infinity goes as null."""
    return _utf8(_ENCODER.encode(dict((name, _sendable(value)) for name, value in fields.items())))


def encode_velocity(echo, after, velocity, careful):
    # type: (float, float, Vector, bool) -> bytes
    """Return the body of a drive with a velocity and nothing else; all numbers are finite. A command waits for it, and
    a template takes a third of the time of `encode`."""
    x, y, turn = velocity
    numbers = float(echo), float(after), float(x), float(y), float(turn)
    return (_VELOCITY % (numbers + ("true" if careful else "false",))).encode("ascii")  # noqa: RUF005


def encode_report(report):
    # type: (Report) -> bytes
    """A report's body; it always fits a datagram."""
    fields = dict(zip(report._fields, report))  # noqa: B905
    fields["reason"] = short(report.reason)
    # In whole cm/s: written in a third of the time that it takes to write floats.
    fields["allowed"] = [int(round(speed * 100.0)) for speed in report.allowed]  # noqa: RUF046  Python 2.7 rounds to a float
    fields["given"] = [round(part, 4) for part in report.given]
    fields["started"] = None if report.started is None else round(report.started, 3)
    for name in ("gap", "command_age"):
        fields[name] = round(fields[name], 3) if abs(fields[name]) < INFINITY else None
    fields["goal"] = report.goal and {"id": report.goal.number, "state": report.goal.state}
    return encode(type="report", **fields)


def decode(body):
    # type: (bytes) -> Dict[str, Any]
    """The fields of a body.

    Raises:
        BadMessage: It is not a JSON object of ours.
    """
    if len(body) > MAX_DATAGRAM:
        raise BadMessage("longer than %d bytes" % MAX_DATAGRAM)
    fields = None
    try:
        fields = _DECODER.decode(body.decode("utf-8"))
    except BadMessage:
        raise
    except (ValueError, RuntimeError):  # RuntimeError: nested too deeply
        pass
    if not isinstance(fields, dict) or not isinstance(fields.get("type"), TEXT):
        raise BadMessage("not a JSON object with a type")
    return fields


def parse_for_robot(body):
    # type: (bytes) -> Union[Drive, Ask]
    """What a pilot sent.

    Raises:
        BadMessage: It cannot be understood, or holds a number that is not finite.
    """
    fields = decode(body)
    if fields["type"] == "drive":
        velocity = fields.get("velocity")
        return Drive(
            _number(fields, "echo"),
            _number(fields, "after"),
            None if velocity is None else _three(fields, "velocity"),
            _flag(fields, "careful"),
            _goal(fields),
            _flag(fields, "hard"),
        )
    if fields["type"] == "ask":
        what = _text(fields, "what")
        if what not in REQUESTS:
            raise BadMessage("there is no request %r; requests: %s" % (what, ", ".join(REQUESTS)))
        return Ask(_whole(fields, "id"), what)
    raise BadMessage("%r is not what a pilot sends" % (fields["type"],))


def parse_report(fields):
    # type: (Dict[str, Any]) -> Report
    """A report of the robot, from `decode`.

    Raises:
        BadMessage: It is not one.
    """
    gated = fields.get("allowed") != []
    return Report(
        _number(fields, "stamp"),
        _whole(fields, "seq"),
        printable(_text(fields, "state")),
        printable(_text(fields, "reason")),
        _three(fields, "given"),
        tuple(speed / 100.0 for speed in _numbers(fields, "allowed", SECTORS)) if gated else (),
        INFINITY if fields.get("gap") is None else _number(fields, "gap"),
        _sector(fields),
        INFINITY if fields.get("command_age") is None else _number(fields, "command_age"),
        _flag(fields, "scanning"),
        _goal_state(fields),
        None if fields.get("started") is None else _number(fields, "started"),
    )


def printable(text):
    # type: (str) -> str
    """Text of the other side for a terminal or a window: control characters and the like become blanks."""
    if is_printable(text):
        return text
    return TEXT().join(letter if is_printable(letter) else TEXT(" ") for letter in text)


def is_printable(text):
    # type: (str) -> bool
    """Return what `str.isprintable` returns, which Python 2.7 does not have."""
    if PRINTABLE is not None:
        return bool(PRINTABLE(text))
    return all(letter == " " or unicodedata.category(letter)[0] not in "CZ" for letter in TEXT(text))


def short(text):
    # type: (str) -> str
    """Return as much of a printable text as takes at most `MAX_TEXT` bytes on the wire."""
    if isinstance(text, bytes):  # in Python 2.7, text that was written as a literal
        text = text.decode("utf-8", "replace")
    text = printable(text[:MAX_TEXT])
    if len(text) <= MAX_TEXT // 2 and max(text or " ") <= "~":  # a quotation mark takes two
        return text
    while len(_utf8(_ENCODER.encode(text))) > MAX_TEXT + 2:
        text = text[: len(text) * 9 // 10]
    return text


def _sector(fields):
    # type: (Dict[str, Any]) -> int
    sector = _whole(fields, "sector")
    if not -1 <= sector < SECTORS:
        raise BadMessage("sector is out of range")
    return sector


def _refuse_constant(name):
    # type: (str) -> float
    raise BadMessage("%s is not a number that can be used" % name)


# Made once: json.dumps and json.loads with options make a new one each time.
_ENCODER = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False)
_DECODER = json.JSONDecoder(parse_constant=_refuse_constant)


def _utf8(text):
    # type: (Union[str, bytes]) -> bytes
    return text if isinstance(text, bytes) else text.encode("utf-8")


def _sendable(value):
    # type: (Any) -> Any
    return None if isinstance(value, float) and not abs(value) < INFINITY else value


def _number(fields, name):
    # type: (Dict[str, Any], str) -> float
    return _finite(fields.get(name), name)


def _finite(value, name):
    # type: (Any, str) -> float
    if isinstance(value, bool) or not isinstance(value, NUMBERS):
        raise BadMessage("%s is not a number" % name)
    if not abs(value) <= LARGEST:  # catches what json makes of 1e999, and whole numbers no float can hold
        raise BadMessage("%s is out of range" % name)
    return float(value)


def _whole(fields, name):
    # type: (Dict[str, Any], str) -> int
    value = fields.get(name)
    if isinstance(value, bool) or not isinstance(value, WHOLE) or not abs(value) < 1 << 53:
        raise BadMessage("%s is not a whole number" % name)
    return int(value)


def _numbers(fields, name, count):
    # type: (Dict[str, Any], str, int) -> Tuple[float, ...]
    values = fields.get(name)
    if not isinstance(values, list) or len(values) != count:
        raise BadMessage("%s is not a list of %d" % (name, count))
    return tuple([_finite(value, name) for value in values])


def _three(fields, name):
    # type: (Dict[str, Any], str) -> Vector
    first, second, third = _numbers(fields, name, 3)
    return first, second, third


def _goal(fields):
    # type: (Dict[str, Any]) -> Optional[Goal]
    goal = _part(fields, "goal")
    return None if goal is None else Goal(_whole(goal, "id"), _three(goal, "pose"))


def _goal_state(fields):
    # type: (Dict[str, Any]) -> Optional[GoalState]
    goal = _part(fields, "goal")
    if goal is None:
        return None
    if goal.get("state") not in GOAL_STATES:
        raise BadMessage("the goal has no state that is known")
    return GoalState(_whole(goal, "id"), goal["state"])


def _part(fields, name):
    # type: (Dict[str, Any], str) -> Optional[Dict[str, Any]]
    part = fields.get(name)
    if part is not None and not isinstance(part, dict):
        raise BadMessage("%s is not an object" % name)
    return part


def _text(fields, name):
    # type: (Dict[str, Any], str) -> str
    value = fields.get(name)
    if not isinstance(value, TEXT) or len(value) > 400:
        raise BadMessage("%s is not a short text" % name)
    return value


def _flag(fields, name):
    # type: (Dict[str, Any], str) -> bool
    value = fields.get(name, False)
    if not isinstance(value, bool):
        raise BadMessage("%s is neither true nor false" % name)
    return value
