"""JSON as Robotino prints it, and how large the bodies are that it takes.

The real robot prints whole numbers without a decimal point ([0,0,0,0,0,0,27501] is an odometry reading), takes any
content type, and answers 200 with an empty body for hardware that is absent. What it does with malformed bodies isn't
published; here `telepresence.web.json_app` refuses them with a reason, and they have no effect.
"""

from __future__ import annotations

import json
from typing import Any

MAX_COMMAND = 64 * 1024
"""Largest body of a command [bytes]; the longest real one has some 60."""
MAX_PROGRAM = 8 * 1024 * 1024
"""Largest body of an uploaded program [bytes]."""

_DECIMALS = 12


def to_json(value: Any) -> bytes:
    """Return `value` as the robot prints it."""
    return json.dumps(_printable(value), separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()


def _printable(value: Any) -> Any:
    if isinstance(value, float):
        rounded = round(value, _DECIMALS)
        return int(rounded) if rounded == int(rounded) else rounded
    if isinstance(value, dict):
        return {key: _printable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_printable(item) for item in value]
    return value
