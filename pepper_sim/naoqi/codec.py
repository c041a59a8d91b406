"""The qi messaging format: header, values by signature, metaobjects. No sockets here.

Why it exists: libqi's Python binding sends `bytes` inside a list as a string, and every number as int64 or float64. A
real robot's camera answers with a list of dynamics `[m]` that holds int32, float32 and raw. `raw_server` serves such
answers.

Message (little-endian): a header of 28 bytes, then the payload.

    magic 42 DE AD 42 | uint32 id | uint32 payload size | uint16 version 0 | uint8 type | uint8 flags
    | uint32 service | uint32 object | uint32 action

Types: 1 call, 2 reply, 3 error, 4 post, 5 event, 6 capability, 7 cancel, 8 cancelled.
Values: fixed-size numbers as they are, bool one byte, string and raw a uint32 length and the bytes, list and map a
uint32 count and the elements, tuple its members, dynamic its signature as a string and the value, error a dynamic
string. Sources: libqi 4.0 (BSD-3-Clause) `qi/messaging`, checked by experiment against PyPI qi 3.1.5.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

MAGIC = 0x42ADDE42
HEADER = struct.Struct("<IIIHBBIII")
CALL, REPLY, ERROR, POST = 1, 2, 3, 4

_NUMBERS = {code: struct.Struct("<" + kind) for code, kind in zip("bcCwWiIlLfd", "?bBhHiIqQfd", strict=True)}
_LENGTH = struct.Struct("<I")
_MAX_DEPTH = 32


class CodecError(ValueError):
    """The bytes or values do not fit the protocol."""


@dataclass(frozen=True)
class Header:
    """One message's header; see the module's docstring."""

    identity: int
    size: int
    kind: int
    service: int
    object: int
    action: int

    def pack(self) -> bytes:
        return HEADER.pack(MAGIC, self.identity, self.size, 0, self.kind, 0, self.service, self.object, self.action)

    @classmethod
    def unpack(cls, data: bytes) -> Header:
        """Read a header from its 28 bytes.

        Raises: CodecError: The magic number or the version is not qi's.
        """
        magic, identity, size, version, kind, _flags, service, obj, action = HEADER.unpack(data)
        if magic != MAGIC or version != 0:
            raise CodecError(f"not a qi message: magic {magic:#x}, version {version}")
        return cls(identity, size, kind, service, obj, action)


@functools.lru_cache(maxsize=1024)
def split_signature(signature: str) -> tuple[str, ...]:
    """Split a signature into its types: "(ss[i])b" -> ("(ss[i])", "b"). Struct annotations `<...>` are dropped.

    Raises: CodecError: Brackets do not match, or a type is unknown.
    """
    kinds, rest = [], signature
    while rest:
        kind, rest = _take(rest, 0)
        kinds.append(kind)
    return tuple(kinds)


def _take(text: str, depth: int) -> tuple[str, str]:
    """Return the first type of `text` and the rest."""
    if depth > _MAX_DEPTH or not text:
        raise CodecError(f"bad signature near {text[:40]!r}")
    head = text[0]
    if head in "vsmroX" or head in _NUMBERS:
        return head, text[1:]
    if head == "+":
        inner, rest = _take(text[1:], depth + 1)
        return "+" + inner, rest
    closing = {"[": "]", "(": ")", "{": "}"}.get(head)
    if closing is None:
        raise CodecError(f"unknown type {head!r} in a signature")
    inside, rest = "", text[1:]
    while rest and rest[0] != closing:
        kind, rest = _take(rest, depth + 1)
        inside += kind
    if not rest:
        raise CodecError(f"{closing!r} is missing in a signature")
    rest = rest[1:]
    if rest.startswith("<"):
        level = 0
        for index, char in enumerate(rest):
            level += (char == "<") - (char == ">")
            if level == 0:
                rest = rest[index + 1 :]
                break
        else:
            raise CodecError("'>' is missing in a signature")
    return head + inside + closing, rest


class Encoder:
    """Collects values; raw data is kept as a view and not copied."""

    def __init__(self) -> None:
        self._tail = bytearray()
        self._parts: list[bytearray | memoryview] = [self._tail]

    def put(self, signature: str, value: Any) -> Encoder:
        """Append `value` as the one type that `signature` names.

        Raises: CodecError: The value does not fit.
        """
        (kind,) = split_signature(signature)
        self._put(kind, value)
        return self

    def buffers(self) -> list[bytearray | memoryview]:
        """Return what was put, in order, for `socket.sendmsg`."""
        return [part for part in self._parts if len(part)]

    def _put(self, kind: str, value: Any) -> None:
        tail = self._tail
        head = kind[0]
        if head in _NUMBERS:
            try:
                tail += _NUMBERS[head].pack(value)
            except struct.error as error:
                raise CodecError(f"{value!r} does not fit type {head}: {error}") from None
        elif head == "s":
            data = value.encode() if isinstance(value, str) else bytes(value)
            tail += _LENGTH.pack(len(data)) + data
        elif head == "r":
            view = memoryview(value).cast("B")
            tail += _LENGTH.pack(view.nbytes)
            self._tail = bytearray()
            self._parts += [view, self._tail]
        elif head == "m":
            kind = dynamic_kind(value)
            self._put("s", kind)
            self._put(kind, value)
        elif head == "[":
            (element,) = split_signature(kind[1:-1])
            tail += _LENGTH.pack(len(value))
            for item in value:
                self._put(element, item)
        elif head == "{":
            key_kind, value_kind = split_signature(kind[1:-1])
            tail += _LENGTH.pack(len(value))
            for key, item in value.items():
                self._put(key_kind, key)
                self._put(value_kind, item)
        elif head == "(":
            members = split_signature(kind[1:-1])
            if len(members) != len(value):
                raise CodecError(f"{kind} needs {len(members)} members, got {len(value)}")
            for member, item in zip(members, value, strict=True):
                self._put(member, item)
        elif head != "v":
            raise CodecError(f"type {kind} cannot be sent")


def dynamic_kind(value: Any) -> str:
    """Return the type in which NAOqi sends `value` inside a dynamic: int32, float32, raw, `[m]` ...

    Raises: CodecError: The format has no type for it.
    """
    if value is None:
        return "v"
    if isinstance(value, bool):
        return "b"
    if isinstance(value, int):
        return "i" if -(2**31) <= value < 2**31 else "l"
    if isinstance(value, float):
        return "f"
    if isinstance(value, str):
        return "s"
    if isinstance(value, bytes | bytearray | memoryview | np.ndarray):
        return "r"
    if isinstance(value, list | tuple):
        return "[m]"
    if isinstance(value, dict):
        return "{mm}"
    raise CodecError(f"a {type(value).__name__} has no type on the wire")


class Decoder:
    """Reads values from one payload.

    Raises (every method): CodecError: The payload ends early, or what it holds makes no sense.
    """

    def __init__(self, payload: bytes) -> None:
        self._data = memoryview(payload)
        self._at = 0

    def get(self, signature: str) -> Any:
        """Return the next value, of the one type that `signature` names. Raw data comes as bytes."""
        (kind,) = split_signature(signature)
        return self._get(kind, 0)

    def _bytes(self, size: int) -> memoryview:
        end = self._at + size
        if end > len(self._data):
            raise CodecError(f"{size} bytes announced, {len(self._data) - self._at} left")
        piece, self._at = self._data[self._at : end], end
        return piece

    def _count(self) -> int:
        count = _LENGTH.unpack(self._bytes(4))[0]
        if count > len(self._data) - self._at:  # every element but void takes at least a byte
            raise CodecError(f"{count} elements announced, {len(self._data) - self._at} bytes left")
        return count

    def _get(self, kind: str, depth: int) -> Any:
        if depth > _MAX_DEPTH:
            raise CodecError("values are nested too deeply")
        head = kind[0]
        if head in _NUMBERS:
            number = _NUMBERS[head]
            return number.unpack(self._bytes(number.size))[0]
        if head in "sr":
            data = bytes(self._bytes(_LENGTH.unpack(self._bytes(4))[0]))
            return data.decode("utf-8", "replace") if head == "s" else data
        if head == "m":
            (inner,) = split_signature(self._get("s", depth + 1)) or ("v",)
            return self._get(inner, depth + 1)
        if head == "v":
            return None
        if head == "[":
            (element,) = split_signature(kind[1:-1])
            return [self._get(element, depth + 1) for _ in range(self._count())]
        if head == "{":
            key, item = split_signature(kind[1:-1])
            pairs = [(self._get(key, depth + 1), self._get(item, depth + 1)) for _ in range(self._count())]
            try:
                return dict(pairs)
            except TypeError:
                raise CodecError("a map's key is a list or a map") from None
        if head == "(":
            return tuple(self._get(member, depth + 1) for member in split_signature(kind[1:-1]))
        raise CodecError(f"type {kind} cannot be received")


@dataclass(frozen=True)
class MethodDescription:
    """A method as a metaobject lists it; `parameters` is a tuple signature such as "(sii)"."""

    uid: int
    returns: str
    name: str
    parameters: str
    description: str = ""


METAOBJECT = "({I(Issss[(ss)]s)}{I(Iss)}{I(Iss)}s)"

OBJECT_METHODS = (
    MethodDescription(0, "L", "registerEvent", "(IIL)"),
    MethodDescription(1, "v", "unregisterEvent", "(IIL)"),
    MethodDescription(2, METAOBJECT, "metaObject", "(I)"),
    MethodDescription(3, "v", "terminate", "(I)"),
    MethodDescription(8, "L", "registerEventWithSignature", "(IILs)"),
)
"""The methods of every qi object."""


def metaobject(methods: Iterable[MethodDescription], signals: Iterable[tuple[int, str, str]] = ()) -> tuple:
    """Return a METAOBJECT value for these methods and signals (uid, name, signature), OBJECT_METHODS included."""
    table: dict[int, tuple] = {
        method.uid: (method.uid, method.returns, method.name, method.parameters, method.description, [], "")
        for method in (*OBJECT_METHODS, *methods)
    }
    return table, {uid: (uid, name, signature) for uid, name, signature in signals}, {}, ""
