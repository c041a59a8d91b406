"""The text on Robotino's wire: JSON as the real robot prints it, and request bodies read with care.

The real robot prints whole numbers without a decimal point ([0,0,0,0,0,0,27501] is an odometry reading), takes any
content type, and answers 200 with an empty body for hardware that is absent. What it does with malformed bodies isn't
published; here they are refused with a reason and have no effect.
"""

from __future__ import annotations

import json
import math
from typing import Any

MAX_COMMAND = 64 * 1024
"""Largest body of a command [bytes]; the longest real one has some 60."""
MAX_PROGRAM = 8 * 1024 * 1024
"""Largest body of an uploaded program [bytes]."""

_DECIMALS = 12


class BadRequest(ValueError):
    """The body is not what this path takes; the text says why."""


def to_json(value: Any) -> bytes:
    """`value` as the robot prints it."""
    return json.dumps(_printable(value), separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()


def from_json(body: bytes) -> Any:
    """The value in a request's body.

    Raises:
        BadRequest: It is empty, not JSON, or holds numbers that no motor can take.
    """
    if not body.strip():
        raise BadRequest("the body is empty; JSON is expected")
    try:
        return json.loads(body.decode("utf-8"), parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        raise BadRequest(f"the body is not UTF-8: {error.reason} at byte {error.start}") from None
    except BadRequest:
        raise
    except RecursionError:
        raise BadRequest("the body is nested too deeply") from None
    except ValueError as error:
        raise BadRequest(f"the body is not JSON: {error}") from None


def numbers(value: Any, count: int, meaning: str) -> tuple[float, ...]:
    """`count` finite numbers; raises BadRequest otherwise. `meaning` tells the caller what belongs there."""
    if not isinstance(value, list) or len(value) != count:
        raise BadRequest(f"expected {meaning}: an array of {count} numbers, got {_shown(value)}")
    return tuple(number(item, meaning) for item in value)


def number(value: Any, meaning: str) -> float:
    """A finite number; raises BadRequest otherwise."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadRequest(f"expected {meaning}: {_shown(value)} is not a number")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise BadRequest(f"expected {meaning}: {_shown(value)} is not finite")
    return found


def index(value: Any, count: int, meaning: str) -> int:
    """A whole number from 0 to `count` - 1; raises BadRequest otherwise."""
    found = number(value, meaning)
    if found != int(found) or not 0 <= found < count:
        raise BadRequest(f"expected {meaning}: a whole number from 0 to {count - 1}, got {_shown(value)}")
    return int(found)


def boolean(value: Any, meaning: str) -> bool:
    """True or false; raises BadRequest otherwise."""
    if not isinstance(value, bool):
        raise BadRequest(f"expected {meaning}: true or false, got {_shown(value)}")
    return value


def booleans(value: Any, count: int, meaning: str) -> list[bool]:
    """`count` times true or false; raises BadRequest otherwise."""
    if not isinstance(value, list) or len(value) != count:
        raise BadRequest(f"expected {meaning}: an array of {count} booleans, got {_shown(value)}")
    return [boolean(item, meaning) for item in value]


def member(value: Any, name: str, meaning: str) -> Any:
    """The member `name` of an object; raises BadRequest without one."""
    if not isinstance(value, dict):
        raise BadRequest(f"expected {meaning}: an object, got {_shown(value)}")
    if name not in value:
        raise BadRequest(f"expected {meaning}: the object has no {name!r}")
    return value[name]


def text(value: Any, meaning: str) -> str:
    """A string that is not blank; raises BadRequest otherwise."""
    if not isinstance(value, str) or not value.strip():
        raise BadRequest(f"expected {meaning}: a text, got {_shown(value)}")
    return value.strip()


def _printable(value: Any) -> Any:
    if isinstance(value, float):
        rounded = round(value, _DECIMALS)
        return int(rounded) if rounded == int(rounded) else rounded
    if isinstance(value, dict):
        return {key: _printable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_printable(item) for item in value]
    return value


def _refuse_constant(name: str) -> None:
    raise BadRequest(f"{name} is not a number a robot can use")


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= 60 else shown[:57] + "..."
