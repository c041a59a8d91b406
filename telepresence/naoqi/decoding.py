"""Decoders: one function for each signature, made of those of its parts. `codec` is what others use.

Every length and count is compared with the bytes that are left before anything of its size is made.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from .dynamics import Record
from .signature import (
    MAX_DEPTH,
    MAX_LENGTH,
    NUMBER_FORMATS,
    Kind,
    SignatureCache,
    WireError,
    parse,
    shorten,
)

MAX_ELEMENTS = 1 << 22
"""Elements in all lists and maps of one payload together: each costs more memory here than on the wire."""
_NOTHING_COST = 4096
"""An element that takes no bytes, as in [v] or [()], costs as much as so many others."""
_SIGNATURE_COST = 64
"""A character of a signature that was not met before costs as much as so many elements."""

_length = struct.Struct("<I").unpack_from
_float32 = struct.Struct("<f").unpack_from
_dynamic_head = struct.Struct("<IBI").unpack_from
"""A signature of one character, and the four bytes after it."""
_STRING, _FLOAT32, _INT32 = b"sfi"


class Reader:
    """A payload that is being decoded."""

    __slots__ = ("data", "elements", "level", "objects", "size")

    def __init__(self, payload: Any, objects: Any) -> None:
        if type(payload) not in (bytes, bytearray):
            whole = payload.obj if type(payload) is memoryview else None
            same = isinstance(whole, (bytes, bytearray)) and payload.contiguous and len(whole) == payload.nbytes
            payload = whole if same else bytes(payload)
        self.data = payload
        self.size = len(self.data)
        self.objects = objects
        self.level = 0
        self.elements = MAX_ELEMENTS

    def read(self, decoder: Decoder, at: int) -> tuple[Any, int]:
        """Return the value at this offset, and where it ends.

        Raises:
            WireError: There is none.
        """
        try:
            return decoder(self, at)
        except (struct.error, IndexError):
            raise WireError(f"Read Past End: the payload of {self.size} bytes ends within a value") from None

    def charge(self, elements: int) -> None:
        """Count elements that are about to be made."""
        self.elements -= elements
        if self.elements < 0:
            raise WireError(f"more than {MAX_ELEMENTS} elements in one payload")


Decoder = Callable[[Reader, int], "tuple[Any, int]"]

_DECODERS = SignatureCache()


def decoder_of(signature: str, reader: Reader) -> Decoder:
    """Return the decoder of a type, counted as one within the type that is being read.

    Raises:
        WireError: The signature is invalid, or stands for nothing that can be received.
    """
    found = _DECODERS.get(signature)
    if found is None:
        reader.charge(len(signature) * _SIGNATURE_COST)
        kind = parse(signature)
        found = max(1, kind.depth), _make(kind)
        _DECODERS.keep(signature, found)
    reader.level += found[0]
    if reader.level > MAX_DEPTH + 1:
        raise WireError(f"values are nested deeper than {MAX_DEPTH}")
    return found[1]


def _make(kind: Kind) -> Decoder:
    code = kind.code
    if code in NUMBER_FORMATS:
        return _NUMBERS[code]
    if code in _PLAIN:
        return _PLAIN[code]
    if code in "[#~":
        return _make_list(kind.children[0])
    if code == "{":
        return _make_map(*kind.children)
    if code == "(":
        return _make_tuple(kind)
    if code == "+":
        return _make_optional(_make(kind.children[0]))
    raise WireError(f"values of type {shorten(kind.text)} cannot be received")


def _make_number(code: str) -> Decoder:
    form = struct.Struct("<" + NUMBER_FORMATS[code])
    unpack, size = form.unpack_from, form.size

    def number(reader: Reader, at: int) -> tuple[Any, int]:
        return unpack(reader.data, at)[0], at + size

    return number


def _nothing(_reader: Reader, at: int) -> tuple[Any, int]:
    return None, at


def _bool(reader: Reader, at: int) -> tuple[Any, int]:
    byte = reader.data[at]
    if byte > 1:
        raise WireError(f"Expected 0 or 1 when converting to bool, not {byte}")
    return byte == 1, at + 1


def _end(reader: Reader, at: int) -> int:
    """Return where the bytes end whose length stands at `at`."""
    (size,) = _length(reader.data, at)
    end: int = at + 4 + size
    if end > reader.size:
        raise WireError(f"{size} bytes are announced, {reader.size - at - 4} are left")
    return end


def _string(reader: Reader, at: int) -> tuple[Any, int]:
    end = _end(reader, at)
    data = reader.data[at + 4 : end]
    try:
        return data.decode(), end
    except UnicodeDecodeError:
        return bytes(data), end


def _raw(reader: Reader, at: int) -> tuple[Any, int]:
    end = _end(reader, at)
    return bytearray(memoryview(reader.data)[at + 4 : end]), end


def _object(reader: Reader, at: int) -> tuple[Any, int]:
    if reader.objects is None:
        raise WireError("an object cannot be received here")
    value, end = reader.objects.read(memoryview(reader.data), at)
    if not at <= end <= reader.size:
        raise WireError("an object's reference ends beyond the payload")
    return value, end


def _count(reader: Reader, at: int, min_size: int, width: int) -> int:
    """Return the count at this offset."""
    count: int = _length(reader.data, at)[0]
    left = reader.size - at - 4
    if count * min_size > left:
        raise WireError(f"{count} elements are announced, {left} bytes are left")
    reader.charge(count * width * (1 if min_size else _NOTHING_COST))
    return count


def _make_list(element: Kind) -> Decoder:
    code, min_size, width = element.code, element.min_size, element.width
    if code in NUMBER_FORMATS:
        return _make_numbers(NUMBER_FORMATS[code])
    if code == "m":
        return _dynamics
    get = _make(element)

    def items(reader: Reader, at: int) -> tuple[Any, int]:
        count = _count(reader, at, min_size, width)
        at += 4
        values = []
        for _ in range(count):
            value, at = get(reader, at)
            values.append(value)
        return values, at

    return items


def _make_numbers(code: str) -> Decoder:
    size = struct.calcsize("<" + code)

    def numbers(reader: Reader, at: int) -> tuple[Any, int]:
        count = _count(reader, at, size, 1)
        return list(struct.unpack_from(f"<{count}{code}", reader.data, at + 4)), at + 4 + count * size

    return numbers


def _make_map(key: Kind, item: Kind) -> Decoder:
    get_key, get_item = _make(key), _make(item)
    min_size, width = key.min_size + item.min_size, key.width + item.width

    def pairs(reader: Reader, at: int) -> tuple[Any, int]:
        count = _count(reader, at, min_size, width)
        at += 4
        values = {}
        for _ in range(count):
            name, at = get_key(reader, at)
            value, at = get_item(reader, at)
            try:
                values[name] = value
            except TypeError:
                if not isinstance(name, bytearray):
                    raise WireError("a map's key is a list or a map") from None
                values[bytes(name)] = value
        return values, at

    return pairs


def _make_tuple(kind: Kind) -> Decoder:
    codes = [child.code for child in kind.children]
    fields = kind.annotation.fields if kind.annotation else ()
    named = bool(fields) and len(set(fields)) == len(fields) == len(codes)
    if codes and all(code in NUMBER_FORMATS for code in codes):
        form = struct.Struct("<" + "".join([NUMBER_FORMATS[code] for code in codes]))
        unpack, size = form.unpack_from, form.size

        def fixed(reader: Reader, at: int) -> tuple[Any, int]:
            values = unpack(reader.data, at)
            return Record(zip(fields, values)) if named else values, at + size

        return fixed
    gets = [_make(child) for child in kind.children]

    def members(reader: Reader, at: int) -> tuple[Any, int]:
        values = []
        for get in gets:
            value, at = get(reader, at)
            values.append(value)
        return Record(zip(fields, values)) if named else tuple(values), at

    return members


def _make_optional(get: Decoder) -> Decoder:
    def optional(reader: Reader, at: int) -> tuple[Any, int]:
        present, at = _bool(reader, at)
        return get(reader, at) if present else (None, at)

    return optional


def _dynamic(reader: Reader, at: int) -> tuple[Any, int]:
    data = reader.data
    (size,) = _length(data, at)
    if size == 1:
        get = _LEAVES[data[at + 4]]
        if get is not None:
            return get(reader, at + 5)
    if size > MAX_LENGTH:
        raise WireError(f"Invalid signature: {size} characters, {MAX_LENGTH} are allowed")
    begin, at = at + 4, at + 4 + size
    if at > reader.size:
        raise WireError(f"{size} bytes are announced, {reader.size - begin} are left")
    if size == 0:
        return None, at
    try:
        signature = data[begin:at].decode("ascii")
    except UnicodeDecodeError:
        raise WireError(f"Invalid signature {shorten(bytes(data[begin:at]))}") from None
    level = reader.level
    value, at = decoder_of(signature, reader)(reader, at)
    reader.level = level
    return value, at


def _dynamics(reader: Reader, at: int) -> tuple[Any, int]:
    """Decode a list of dynamics."""
    count = _count(reader, at, 4, 1)
    at += 4
    data = reader.data
    if count > 3:
        same = _same_numbers(data, at, count)
        if same is not None:
            return same
    values = []
    last = reader.size - 9
    for _ in range(count):
        if at <= last:  # the usual ones without a call of their own
            size, code, length = _dynamic_head(data, at)
            if size == 1:
                end = at + 9 + length
                if code == _STRING and end <= reader.size:
                    try:
                        values.append(data[at + 9 : end].decode())
                    except UnicodeDecodeError:
                        values.append(bytes(data[at + 9 : end]))
                    at = end
                    continue
                if code == _FLOAT32:
                    values.append(_float32(data, at + 5)[0])
                    at += 9
                    continue
                if code == _INT32:
                    values.append(length if length < 1 << 31 else length - (1 << 32))
                    at += 9
                    continue
        value, at = _dynamic(reader, at)
        values.append(value)
    return values, at


def _same_numbers(data: Any, at: int, count: int) -> tuple[list, int] | None:
    """Return a list of dynamics that all hold numbers of one type, None if they do not."""
    if data[at : at + 4] != b"\1\0\0\0":
        return None
    code = chr(data[at + 4])
    form = NUMBER_FORMATS.get(code)
    if form is None:
        return None
    size = struct.calcsize("<" + form)
    step = 5 + size
    end = at + step * count
    block = data[at:end]
    if len(block) < step * count:
        return None
    zeros = bytes(count)
    if (
        block[4::step] != code.encode() * count
        or block[0::step] != b"\1" * count
        or block[1::step] != zeros
        or block[2::step] != zeros
        or block[3::step] != zeros
    ):
        return None
    packed = bytearray(size * count)
    for column in range(size):
        packed[column::size] = block[5 + column :: step]
    return list(struct.unpack(f"<{count}{form}", packed)), end


_NUMBERS = {code: _make_number(code) for code in NUMBER_FORMATS}
_PLAIN: dict[str, Decoder] = {
    "v": _nothing,
    "b": _bool,
    "s": _string,
    "r": _raw,
    "m": _dynamic,
    "o": _object,
}
_LEAVES: list[Decoder | None] = [None] * 256
"""Decoders of dynamics whose signature is one character, by that."""
for _code in "vbsr":
    _LEAVES[ord(_code)] = _PLAIN[_code]
for _code, _decoder in _NUMBERS.items():
    _LEAVES[ord(_code)] = _decoder
