"""How much of this machine's RAM a value of ALMemory takes."""

from __future__ import annotations

import sys
from typing import Any

SMALL = 1024
"""Up to so many bytes the value of a key weighs nothing: the number of keys limits these, and they are stored all the
time."""
MOMENT = 200
"""What an entry of an event's history takes besides its value [bytes]."""
_NUMBERS = frozenset({bool, int, float, type(None)})


def size_of(value: Any) -> int:
    """Return about how many bytes a value takes with all that is in it, 0 for a number."""
    if type(value) in _NUMBERS:
        return 0
    total, pending = 0, [value]
    while pending:
        one = pending.pop()
        if isinstance(one, dict):
            pending += [*one.keys(), *one.values()]
        elif isinstance(one, list | tuple):
            pending += one
        total += getattr(one, "nbytes", 0) or sys.getsizeof(one)
    return total


def weight_of(size: int) -> int:
    """Return what a key's value of a size weighs."""
    return size if size > SMALL else 0
