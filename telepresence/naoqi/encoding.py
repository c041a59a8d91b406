"""Encoders: one function for each signature, made of those of its parts. `codec` is what others use."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

from .conversion import convert_kind
from .dynamics import LISTS, PYTHON, ROBOT, Dialect, Record, Typed, integer_type, is_array, plain
from .signature import NUMBER_FORMATS, Kind, SignatureCache, WireError, parse, shorten
from .writer import Reference, Writer

_UNFIT = (struct.error, TypeError, ValueError, OverflowError)
"""What an encoder raises for a value of another type; it is converted then, and tried again."""
_LONG = 4096
"""Raw data of this size or more is not copied [bytes]."""

_length = struct.Struct("<I").pack
_dynamic_integer = struct.Struct("<IBq").pack
_dynamic_int32 = struct.Struct("<IBi").pack
_dynamic_double = struct.Struct("<IBd").pack
_dynamic_float = struct.Struct("<IBf").pack
_STRING_HEADS = [struct.pack("<IBI", 1, 115, size) for size in range(256)]
"""Length of the string -> first bytes of a dynamic that holds it: signature "s" and the length."""


Encoder = Callable[[Writer, Any], object]


def encode_kind(signature: str, value: Any, objects: Any, dialect: Dialect) -> list[Any]:
    """`codec.encode`."""
    encoder = _ENCODERS.get(signature) or _keep(signature)
    writer = Writer(objects, dialect, _DYNAMICS[dialect])
    try:
        encoder(writer, value)
    except _UNFIT:
        writer = Writer(objects, dialect, _DYNAMICS[dialect])
        value = convert_kind(value, parse(signature))
        try:
            encoder(writer, value)
        except _UNFIT as error:
            raise WireError(
                f"{type(value).__name__} has no form as {shorten(signature)}: {shorten(str(error))}"
            ) from None
    return writer.buffers()


_ENCODERS = SignatureCache()


def _keep(signature: str) -> Encoder:
    encoder = _make(parse(signature))
    _ENCODERS.keep(signature, encoder)
    return encoder


def _make(kind: Kind) -> Encoder:
    code = kind.code
    if code in NUMBER_FORMATS:
        return _make_number(code)
    if code in _PLAIN:
        return _PLAIN[code]
    if code in "[#~":
        return _make_list(kind.children[0])
    if code == "{":
        return _make_map(*map(_make, kind.children))
    if code == "(":
        return _make_tuple(kind)
    if code == "+":
        return _make_optional(_make(kind.children[0]))
    raise WireError(f"values of type {shorten(kind.text)} cannot be sent")


def _make_number(code: str) -> Encoder:
    pack = struct.Struct("<" + NUMBER_FORMATS[code]).pack

    def number(writer: Writer, value: Any) -> None:
        writer.append(pack(value))

    return number


def _nothing(_writer: Writer, _value: Any) -> None:
    """Nothing stands for None."""


def _bool(writer: Writer, value: Any) -> None:
    if value is True:
        writer.append(b"\1")
    elif value is False:
        writer.append(b"\0")
    else:
        raise TypeError("no bool")


def _string(writer: Writer, value: Any) -> None:
    if isinstance(value, str):
        value = value.encode()
    elif not isinstance(value, (bytes, bytearray)):
        raise TypeError("no string")
    writer.append(_length(len(value)) + value)


def _raw(writer: Writer, value: Any) -> None:
    view = memoryview(value)
    if getattr(getattr(value, "dtype", None), "hasobject", False):
        raise TypeError("its bytes are addresses")
    try:
        view = view.cast("B")
    except (TypeError, ValueError, NotImplementedError):  # not in one piece, in another order of bytes, or empty
        view = memoryview(view.tobytes())
    writer.append(_length(len(view)))
    if len(view) < _LONG:
        writer.append(view.tobytes())
    else:
        writer.long = True
        writer.append(view)


def _object(writer: Writer, value: Any) -> None:
    if writer.objects is None:
        raise WireError(f"a {type(value).__name__} has no type on the wire")
    writer.refers = True
    writer.append(Reference(value))


def _check_list(value: Any) -> None:
    if not isinstance(value, (list, tuple)) or isinstance(value, Typed):
        raise TypeError("no list")


def _make_list(element: Kind) -> Encoder:
    code = element.code
    if code in NUMBER_FORMATS:
        return _make_numbers(NUMBER_FORMATS[code])
    if code == "m":
        return _dynamics
    put = _make(element)

    def items(writer: Writer, value: Any) -> None:
        _check_list(value)
        writer.append(_length(len(value)))
        for item in value:
            put(writer, item)

    return items


def _make_numbers(code: str) -> Encoder:
    size = struct.calcsize("<" + code)
    dtype = f"{'<' if size > 1 else '|'}{'f' if code in 'fd' else 'iu'[code.isupper()]}{size}"

    def numbers(writer: Writer, value: Any) -> None:
        if is_array(value) and value.ndim == 1 and value.dtype.str == dtype:
            writer.append(_length(len(value)) + value.tobytes())
            return
        _check_list(value)
        writer.append(struct.pack(f"<I{len(value)}{code}", len(value), *value))

    return numbers


def _make_map(put_key: Encoder, put_item: Encoder) -> Encoder:
    def pairs(writer: Writer, value: Any) -> None:
        if not isinstance(value, Mapping):
            raise TypeError("no map")
        writer.append(_length(len(value)))
        for key, item in value.items():
            put_key(writer, key)
            put_item(writer, item)

    return pairs


def _make_tuple(kind: Kind) -> Encoder:
    codes = [child.code for child in kind.children]
    size = len(codes)
    if size and all(code in NUMBER_FORMATS for code in codes):
        pack = struct.Struct("<" + "".join([NUMBER_FORMATS[code] for code in codes])).pack

        def fixed(writer: Writer, value: Any) -> None:
            _check_list(value)
            writer.append(pack(*value))

        return fixed
    puts = [_make(child) for child in kind.children]

    def members(writer: Writer, value: Any) -> None:
        _check_list(value)
        if len(value) != size:
            raise TypeError("other members")
        for put, item in zip(puts, value):
            put(writer, item)

    return members


def _make_optional(put: Encoder) -> Encoder:
    def optional(writer: Writer, value: Any) -> None:
        if value is None:
            writer.append(b"\0")
        else:
            writer.append(b"\1")
            put(writer, value)

    return optional


def _dynamic(writer: Writer, value: Any) -> None:
    put = writer.dynamics.get(type(value))
    if put is None:
        value = plain(value)
        put = writer.dynamics.get(type(value)) or _dynamic_by_base(writer, value)
    put(writer, value)


def _dynamics(writer: Writer, value: Any) -> None:
    """Encode a list of dynamics, without its signature."""
    _check_list(value)
    size = len(value)
    kinds = set(map(type, value))
    writer.append(_length(size))
    if len(kinds) == 1:
        (kind,) = kinds
        if kind is str:
            data = [item.encode() for item in value]
            heads = _STRING_HEADS
            writer.append(
                b"".join([heads[len(d)] + d if len(d) < 256 else b"\1\0\0\0s" + _length(len(d)) + d for d in data])
            )
            return
        if size > 3 and (kind is float or kind is int):
            code = writer.dialect.floats if kind is float else writer.dialect.integers
            try:
                writer.append(_same_numbers(code, value))
                return
            except (struct.error, OverflowError):
                pass  # some are larger than the others: each for itself
    get = writer.dynamics.get
    for item in value:
        put = get(type(item)) or _dynamic
        put(writer, item)


def _same_numbers(code: str, values: Any) -> bytearray:
    """Return numbers as dynamics of one type: the 5 bytes of the signature before each."""
    size = struct.calcsize(code)
    packed = struct.pack(f"<{len(values)}{NUMBER_FORMATS[code]}", *values)
    step = 5 + size
    data = bytearray((b"\1\0\0\0" + code.encode() + bytes(size)) * len(values))
    for column in range(size):
        data[5 + column :: step] = packed[column::size]
    return data


def _dynamic_none(writer: Writer, _value: Any) -> None:
    writer.append(b"\1\0\0\0v")


def _dynamic_bool(writer: Writer, value: Any) -> None:
    writer.append(b"\1\0\0\0b\1" if value else b"\1\0\0\0b\0")


def _python_integer(writer: Writer, value: Any) -> None:
    try:
        writer.append(_dynamic_integer(1, 108, value))
    except struct.error:
        code = integer_type(value, writer.dialect)
        writer.append(struct.pack("<IcQ", 1, code.encode(), value))


def _robot_integer(writer: Writer, value: Any) -> None:
    try:
        writer.append(_dynamic_int32(1, 105, value))
    except struct.error:
        _python_integer(writer, value)


def _python_float(writer: Writer, value: Any) -> None:
    writer.append(_dynamic_double(1, 100, value))


def _robot_float(writer: Writer, value: Any) -> None:
    try:
        writer.append(_dynamic_float(1, 102, value))
    except OverflowError:
        _python_float(writer, value)


def _dynamic_string(writer: Writer, value: Any) -> None:
    data = value.encode()
    writer.append(b"\1\0\0\0s" + _length(len(data)) + data)


def _dynamic_raw(writer: Writer, value: Any) -> None:
    writer.append(b"\1\0\0\0r")
    _raw(writer, value)


def _dynamic_list(writer: Writer, value: Any) -> None:
    writer.append(b"\3\0\0\0[m]")
    writer.deeper(1)
    _dynamics(writer, value)
    writer.level -= 1


def _dynamic_view(writer: Writer, value: Any) -> None:
    _dynamic_list(writer, list(value))


def _dynamic_tuple(writer: Writer, value: Any) -> None:
    size = len(value)
    writer.append(_length(size + 2) + b"(" + b"m" * size + b")")
    writer.deeper(1)
    for item in value:
        _dynamic(writer, item)
    writer.level -= 1


def _dynamic_map(writer: Writer, value: Any) -> None:
    writer.append(b"\4\0\0\0{mm}" + _length(len(value)))
    writer.deeper(1)
    for key, item in value.items():
        _dynamic(writer, key)
        _dynamic(writer, item)
    writer.level -= 1


def _dynamic_typed(writer: Writer, value: Typed) -> None:
    kind = parse(value.signature)
    text = kind.full.encode()
    writer.append(_length(len(text)) + text)
    depth = max(1, kind.depth)
    writer.deeper(depth)
    encoder = _ENCODERS.get(value.signature) or _keep(value.signature)
    mark, long = len(writer.parts), writer.long
    try:
        encoder(writer, value.value)
    except _UNFIT:
        del writer.parts[mark:]
        writer.long = long
        encoder(writer, convert_kind(value.value, kind))
    writer.level -= depth


def _dynamic_object(writer: Writer, value: Any) -> None:
    writer.append(b"\1\0\0\0o")
    _object(writer, value)


def _dynamic_by_base(writer: Writer, value: Any) -> Encoder:
    """Return the encoder of a value whose type is none of the usual ones, but derived from one or like one."""
    for base in (int, float, str, bytes, bytearray, dict, tuple, list, set, frozenset):
        if isinstance(value, base):
            return writer.dynamics[base]
    if isinstance(value, Mapping):
        return _dynamic_map
    if isinstance(value, LISTS):
        return _dynamic_view
    return _dynamic_raw if is_array(value) else _dynamic_object


_PLAIN: dict[str, Encoder] = {
    "v": _nothing,
    "b": _bool,
    "s": _string,
    "r": _raw,
    "m": _dynamic,
    "o": _object,
}
_ANY_DIALECT: dict[type, Encoder] = {
    type(None): _dynamic_none,
    bool: _dynamic_bool,
    str: _dynamic_string,
    bytes: _dynamic_raw,
    bytearray: _dynamic_raw,
    memoryview: _dynamic_raw,
    list: _dynamic_list,
    dict: _dynamic_map,
    Record: _dynamic_map,
    Typed: _dynamic_typed,
}
_TUPLES = (tuple, set, frozenset)
_DYNAMICS: dict[Dialect, dict[type, Encoder]] = {
    PYTHON: {**_ANY_DIALECT, int: _python_integer, float: _python_float, **dict.fromkeys(_TUPLES, _dynamic_tuple)},
    ROBOT: {**_ANY_DIALECT, int: _robot_integer, float: _robot_float, **dict.fromkeys(_TUPLES, _dynamic_view)},
}
