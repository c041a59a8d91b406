"""Which type a Python value gets inside a dynamic: that is the sender's choice, and senders differ.

PYTHON  int l, float d, bytes r, tuple (mm..), list [m], dict {mm}, None v: the vendor's Python package, which sends
        bytes as a string, however
ROBOT   int i, or l if it needs to, float f, list and tuple [m]; the rest the same: NAOqi 2.x
"""

from __future__ import annotations

import sys
from collections.abc import KeysView, Mapping, ValuesView
from typing import Any, NamedTuple

from .signature import WireError


class Dialect(NamedTuple):
    """A sender's choice. integers: type of those that fit int32; floats: f or d; tuples: whether they stay tuples."""

    name: str
    integers: str
    floats: str
    tuples: bool


PYTHON = Dialect("python", "l", "d", True)
ROBOT = Dialect("robot", "i", "f", False)


class Typed(NamedTuple):
    """A value that goes into a dynamic as this type, in every dialect."""

    signature: str
    value: Any


class Record(dict):
    """An annotated tuple: a dict of its fields that are attributes as well."""

    __slots__ = ()

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no field {name!r}, there are {', '.join(map(str, self))}") from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


LISTS = (list, tuple, set, frozenset, KeysView, ValuesView)
"""What passes for a list where one is declared."""


def is_array(value: object) -> bool:
    """Whether it is a NumPy array. NumPy is not imported for that."""
    numpy = sys.modules.get("numpy")
    return numpy is not None and isinstance(value, numpy.ndarray)


def plain(value: Any) -> Any:
    """Return a NumPy number as Python's; any other value as it is."""
    numpy = sys.modules.get("numpy")
    return value.item() if numpy is not None and isinstance(value, numpy.generic) else value


def signature_of(value: Any, dialect: Dialect = PYTHON, resolve: bool = False) -> str:
    """Return the type of a value inside a dynamic. What has none is an object, "o".

    Args:
        resolve: Look into lists and maps: [1, 2] is "[l]" then, and "[m]" otherwise.

    Raises:
        WireError: It is nested too deeply, or an integer too large.
    """
    try:
        return _signature_of(plain(value), dialect, resolve)
    except RecursionError:
        raise WireError("values are nested too deeply") from None


def integer_type(value: int, dialect: Dialect) -> str:
    """Return i, l or L.

    Raises:
        WireError: It does not fit 64 bits.
    """
    if -(1 << 31) <= value < 1 << 31:
        return dialect.integers
    if -(1 << 63) <= value < 1 << 63:
        return "l"
    if 0 <= value < 1 << 64:
        return "L"
    raise WireError(f"an integer of {value.bit_length()} bits does not fit the 64 of the wire")


def _signature_of(value: Any, dialect: Dialect, resolve: bool) -> str:
    if value is None:
        return "v"
    if isinstance(value, bool):
        return "b"
    if isinstance(value, int):
        return integer_type(value, dialect)
    if isinstance(value, float):
        return dialect.floats
    if isinstance(value, str):
        return "s"
    if isinstance(value, Typed):
        return value.signature
    if isinstance(value, (bytes, bytearray, memoryview)) or is_array(value):
        return "r"
    if isinstance(value, Mapping):
        return f"{{{_common(value.keys(), dialect, resolve)}{_common(value.values(), dialect, resolve)}}}"
    if isinstance(value, (tuple, set, frozenset)) and dialect.tuples:
        return f"({''.join([_signature_of(plain(item), dialect, True) if resolve else 'm' for item in value])})"
    if isinstance(value, LISTS):
        return f"[{_common(value, dialect, resolve)}]"
    return "o"


def _common(values: Any, dialect: Dialect, resolve: bool) -> str:
    if not resolve:
        return "m"
    kinds = {_signature_of(plain(value), dialect, True) for value in values}
    return kinds.pop() if len(kinds) == 1 else "m"
