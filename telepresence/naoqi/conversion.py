"""libqi's implicit conversions: 2.9 for an `i` arrives as 2, a map becomes a named tuple, 2 is no bool.

Source: libqi 4.0 (BSD-3-Clause), src/type/anyreference.cpp. Not a number and infinities pass.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from .dynamics import LISTS, Typed, is_array, plain
from .signature import FLOATS, Kind, WireError, parse, shorten

_BITS = {"c": 8, "C": 8, "w": 16, "W": 16, "i": 32, "I": 32, "l": 64, "L": 64}
_FLOAT32_MAX = 3.4028235677973366e38
"""Smallest float64 that is rounded to infinity."""
_OPTIONAL_FIELDS = {"objectUid": ""}
"""Fields of named tuples that older senders do not know."""


class ConversionError(WireError):
    """A value has no form in the type that is asked for."""


def convert(value: Any, signature: str) -> Any:
    """Return the value as one of that type: what `codec.encode` takes without a change.

    Raises:
        ConversionError: It cannot be one.
        WireError: The signature is invalid.
    """
    return convert_kind(value, parse(signature))


def convert_kind(value: Any, kind: Kind) -> Any:
    """`convert` to a type that is parsed already."""
    if kind.code == "m":
        return value
    while isinstance(value, Typed):
        value = value.value
    return _CONVERTERS.get(kind.code, _refuse)(plain(value), kind)


def _refuse(value: Any, kind: Kind) -> Any:
    shown = f" {shorten(value)}" if value is None or isinstance(value, (bool, int, float, str)) else ""
    raise ConversionError(f"cannot convert {type(value).__name__}{shown} to {shorten(kind.text)}")


def _to_nothing(_value: Any, _kind: Kind) -> None:
    return None


def _to_bool(value: Any, kind: Kind) -> bool:
    if isinstance(value, (bool, int, float)) and value in (0, 1):
        return bool(value)
    return _refuse(value, kind)


def _to_integer(value: Any, kind: Kind) -> int:
    if isinstance(value, float) and math.isfinite(value):
        value = int(value)
    if not isinstance(value, int):
        return _refuse(value, kind)
    bits = _BITS[kind.code]
    low, high = (0, 1 << bits) if kind.code.isupper() else (-1 << bits - 1, 1 << bits - 1)
    if not low <= value < high:
        raise ConversionError(f"{shorten(value)} does not fit {kind.code}: {low} to {high - 1}")
    return int(value)


def _to_float(value: Any, kind: Kind) -> float:
    if not isinstance(value, (int, float)):
        return _refuse(value, kind)
    try:
        number = float(value)
    except OverflowError:
        raise ConversionError(f"{shorten(value)} does not fit {kind.code}") from None
    if kind.code == "f" and math.isfinite(number) and abs(number) >= _FLOAT32_MAX:
        raise ConversionError(f"{number!r} does not fit {kind.code}")
    return number


def _to_string(value: Any, kind: Kind) -> Any:
    if isinstance(value, (bytes, bytearray)):  # a string that is not UTF-8, such as an object's uid
        return bytes(value)
    if not isinstance(value, str):
        return _refuse(value, kind)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ConversionError(f"{shorten(value)} has characters that UTF-8 has not") from None
    return value


def _to_raw(value: Any, kind: Kind) -> Any:
    if isinstance(value, str):
        return _to_string(value, kind).encode()
    if isinstance(value, (bytes, bytearray, memoryview)) or is_array(value):
        return value
    try:
        return memoryview(value)
    except TypeError:
        return _refuse(value, kind)


def _to_list(value: Any, kind: Kind) -> list:
    if is_array(value) and value.ndim:
        value = value.tolist()
    if not isinstance(value, LISTS):
        return _refuse(value, kind)
    (element,) = kind.children
    return [convert_kind(item, element) for item in value]


def _to_map(value: Any, kind: Kind) -> dict:
    key, item = kind.children
    if isinstance(value, Mapping):
        pairs = list(value.items())
    elif isinstance(value, (list, tuple)) and all(isinstance(pair, (list, tuple)) and len(pair) == 2 for pair in value):
        pairs = list(value)
    else:
        return _refuse(value, kind)
    try:
        return {convert_kind(one, key): convert_kind(other, item) for one, other in pairs}
    except TypeError:  # a list as key
        return _refuse(value, kind)


def _to_tuple(value: Any, kind: Kind) -> tuple:
    members = kind.children
    if isinstance(value, Mapping):
        fields = kind.annotation.fields if kind.annotation else ()
        if len(fields) != len(members):
            return _refuse(value, kind)
        return tuple([_member(value, name, member, kind) for name, member in zip(fields, members)])
    if is_array(value) and value.ndim:
        value = value.tolist()
    if not isinstance(value, (list, tuple)):
        return _refuse(value, kind)
    if len(value) != len(members):
        raise ConversionError(f"{shorten(kind.text)} has {len(members)} members, not {len(value)}")
    return tuple([convert_kind(item, member) for item, member in zip(value, members)])


def _member(value: Mapping, name: str, member: Kind, kind: Kind) -> Any:
    if name in value:
        return convert_kind(value[name], member)
    if member.code == "+":
        return None
    if name in _OPTIONAL_FIELDS:
        return _OPTIONAL_FIELDS[name]
    raise ConversionError(f"{shorten(kind.text)} has a field {shorten(name)}, the map has not")


def _to_optional(value: Any, kind: Kind) -> Any:
    return None if value is None else convert_kind(value, kind.children[0])


def _to_object(value: Any, _kind: Kind) -> Any:
    return value


_CONVERTERS: dict[str, Callable[[Any, Kind], Any]] = {
    "v": _to_nothing,
    "b": _to_bool,
    **{code: _to_integer for code in _BITS},
    **{code: _to_float for code in FLOATS},
    "s": _to_string,
    "r": _to_raw,
    "o": _to_object,
    "[": _to_list,
    "#": _to_list,
    "~": _to_list,
    "{": _to_map,
    "(": _to_tuple,
    "+": _to_optional,
}
