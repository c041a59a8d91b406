# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: B904, UP006, UP031
"""Values of NAOqi's messaging as bytes, by signature: the types that programs on the robot meet.

A signature is one letter for a number, a text (s), raw bytes (r), nothing (v) or a dynamic (m: its own signature, then
the value), or [x] list, {kv} map, (xyz) tuple, +x optional; behind a tuple <Name,fields> may stand. Little-endian;
texts, lists and maps begin with their length or count in four bytes. Source: aldebaran/libqi, src/type/signature.cpp
and src/type/binarycodec.cpp.
"""

import numbers
import re
import struct

MYPY = False
if MYPY:
    from typing import Any, Dict, List, Tuple  # noqa: F401, UP035

    Kind = Tuple[str, Tuple["Kind", ...]]  # type: ignore[misc]

DEEPEST = 32
"""Levels to which values and signatures may be nested."""
LONGEST_SIGNATURE = 65536
_CACHED = 200

_NUMBERS = dict((code, struct.Struct("<" + kind)) for code, kind in zip("bcCwWiIlLfd", "?bBhHiIqQfd"))  # noqa: B905
_LENGTH = struct.Struct("<I")
_CLOSING = {"[": "]", "(": ")", "{": "}"}
_PLACE = re.compile(r"\w+::~?\w+:?$")
_parsed = {}  # type: Dict[str, Kind]


class NaoqiError(RuntimeError):
    """NAOqi refuses, is gone, does not answer in time, or sends what makes no sense; the text is for people."""


def error_text(error, longest=120):
    # type: (BaseException, int) -> str
    """What an error says, as one line of at most so many characters; its type if it says nothing.

    A module of NAOqi says where it arose in a line of its own, and why in the next: "\\tALProxy::ALProxy\\n\\tCan't
    find service: X" (ros-naoqi/naoqi_driver, issue 107). Others say it in the first line, and the rest is of no use.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if len(lines) > 1 and _PLACE.match(lines[0]):
        lines[0] = "%s: %s" % (lines[0].rstrip(":"), lines[1])
    return (lines or [type(error).__name__])[0][:longest]


def parse(signature):
    # type: (str) -> Kind
    """Return the one type of a signature: its letter or opening bracket, and the types in it.

    Raises:
        NaoqiError: It is none.
    """
    kind = _parsed.get(signature)
    if kind is None:
        if len(signature) > LONGEST_SIGNATURE:
            raise NaoqiError("a signature of %d letters" % len(signature))
        kind, end = _parse(signature, 0, 0)
        if end != len(signature):
            raise NaoqiError("no signature of one value: %.40r" % signature)
        if len(_parsed) >= _CACHED:
            _parsed.clear()
        _parsed[signature] = kind
    return kind


def _parse(text, at, depth):
    # type: (str, int, int) -> Tuple[Kind, int]
    """The type that begins at a letter, and where it ends."""
    head = text[at : at + 1]
    at += 1
    inside = []  # type: List[Kind]
    closing = _CLOSING.get(head)
    if depth > DEEPEST or not head:
        raise NaoqiError("bad signature: %.40r" % text)
    if head == "+":
        kind, at = _parse(text, at, depth + 1)
        inside.append(kind)
    elif closing:
        while text[at : at + 1] != closing:
            kind, at = _parse(text, at, depth + 1)
            inside.append(kind)
        at += 1
    elif head not in "vsrmo" and head not in _NUMBERS:
        raise NaoqiError("a signature has the unknown type %r" % head)
    if {"[": 1, "{": 2}.get(head, len(inside)) != len(inside):
        raise NaoqiError("bad signature: %.40r" % text)
    if text[at : at + 1] == "<":
        at = _after_annotation(text, at)
    return (head, tuple(inside)), at


def _after_annotation(text, at):
    # type: (str, int) -> int
    open_ = 0
    for place in range(at, len(text)):
        open_ += {"<": 1, ">": -1}.get(text[place], 0)
        if not open_:
            return place + 1
    raise NaoqiError("bad signature: %.40r" % text)


def encode(kind, value, depth=0):
    # type: (Kind, Any, int) -> bytes
    """Return the bytes of a value.

    Raises:
        NaoqiError: It is not of this type.
    """
    head, inside = kind
    if depth > DEEPEST:
        raise NaoqiError("a value is nested too deeply")
    if head == "m":
        name = dynamic_kind(value)
        return _sized(name.encode("ascii")) + encode(parse(name), value, depth + 1)
    try:
        if head in _NUMBERS:
            if head == "b":
                fits = isinstance(value, bool)
            else:
                fits = isinstance(value, numbers.Real if head in "fd" else numbers.Integral)
            if fits:
                return _NUMBERS[head].pack(value)
        elif head == "s" and (isinstance(value, str) or hasattr(value, "encode")):
            return _sized(value if isinstance(value, bytes) else value.encode("utf-8"))
        elif head == "r" and isinstance(value, (bytes, bytearray)):
            return _sized(bytes(value))
        elif head == "v" and value is None:
            return b""
        elif head == "+":
            return b"\0" if value is None else b"\1" + encode(inside[0], value, depth + 1)
        elif head == "[" and isinstance(value, (list, tuple)):
            return _LENGTH.pack(len(value)) + b"".join(encode(inside[0], each, depth + 1) for each in value)
        elif head == "{" and isinstance(value, dict):
            pairs = [encode(inside[0], key, depth + 1) + encode(inside[1], value[key], depth + 1) for key in value]
            return _LENGTH.pack(len(value)) + b"".join(pairs)
        elif head == "(" and isinstance(value, (list, tuple)) and len(value) == len(inside):
            return b"".join([encode(part, each, depth + 1) for part, each in zip(inside, value)])  # noqa: B905
    except (struct.error, OverflowError):
        pass
    raise NaoqiError("%.40r is no value of type %s" % (value, head))


def dynamic_kind(value):
    # type: (Any) -> str
    """Return the signature by which a value goes as a dynamic.

    Raises:
        NaoqiError: There is none.
    """
    if value is None:
        return "v"
    if isinstance(value, bool):
        return "b"
    if isinstance(value, numbers.Integral):
        return "i" if -(2**31) <= int(value) < 2**31 else "l"
    if isinstance(value, numbers.Real):
        return "d"
    if isinstance(value, str) or hasattr(value, "encode"):
        return "s"
    if isinstance(value, (bytes, bytearray)):
        return "r"
    if isinstance(value, (list, tuple)):
        return "[m]"
    if isinstance(value, dict):
        return "{mm}"
    raise NaoqiError("a %s cannot be sent" % type(value).__name__)


def _sized(data):
    # type: (bytes) -> bytes
    return _LENGTH.pack(len(data)) + data


def decode(kind, payload):
    # type: (Kind, bytes) -> Any
    """Return the value at the beginning of a payload; what follows it is ignored. Texts are `str` in both Pythons.

    Raises:
        NaoqiError: There is none.
    """
    return _decode(kind, payload, 0, 0)[0]


def _decode(kind, data, at, depth):
    # type: (Kind, bytes, int, int) -> Tuple[Any, int]
    """The value that begins at a byte, and where it ends."""
    head, inside = kind
    if depth > DEEPEST:
        raise NaoqiError("what came is nested too deeply")
    if head in _NUMBERS:
        number = _NUMBERS[head]
        if at + number.size > len(data):
            raise NaoqiError("what came ends early")
        return number.unpack_from(data, at)[0], at + number.size
    if head == "v":
        return None, at
    if head == "(":
        parts = []
        for part in inside:
            value, at = _decode(part, data, at, depth + 1)
            parts.append(value)
        return tuple(parts), at
    if head == "m":
        name, at = _decode(("s", ()), data, at, depth + 1)
        return _decode(parse(name or "v"), data, at, depth + 1)  # "": a dynamic without a value
    if head == "+":
        there, at = _decode(("b", ()), data, at, depth + 1)
        return _decode(inside[0], data, at, depth + 1) if there else (None, at)
    if head == "o":
        raise NaoqiError("an object came, which programs on the robot do not take")
    if at + 4 > len(data):
        raise NaoqiError("what came ends early")
    count, at = _LENGTH.unpack_from(data, at)[0], at + 4
    if count > len(data) - at:  # an element is a byte at least
        raise NaoqiError("what came ends early")
    if head in "sr":
        piece = data[at : at + count]
        return piece.decode("utf-8", "replace") if head == "s" and bytes is not str else piece, at + count
    values = []
    for _ in range(count):
        begin = at
        value, at = _decode(inside[0] if head == "[" else ("(", inside), data, at, depth + 1)
        if at == begin:
            raise NaoqiError("a list of nothing came")
        values.append(value)
    if head == "[":
        return values, at
    try:
        return dict(values), at
    except TypeError:
        raise NaoqiError("the key of a map is a list or a map")
