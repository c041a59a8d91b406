"""Values to bytes and back, by signature; see `signature` for the types.

Numbers are little-endian, a bool is one byte; strings and raw data have a uint32 length, lists and maps a uint32 count
before them, a tuple is its members in a row, a dynamic its signature as a string and the value, an optional a bool and
perhaps the value. An object is what `objects` makes of it.

A coder is made once for each signature. Raw data goes out uncopied: it must not change until it is sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, Union

from .decoding import Reader, decoder_of
from .dynamics import PYTHON, Dialect
from .encoding import encode_kind
from .message import DYNAMIC_PAYLOAD
from .signature import WireError, parse, shorten

Buffer = Union[bytes, bytearray, memoryview]


class Objects(Protocol):
    """What knows how a connection passes objects by reference."""

    def write(self, value: Any) -> bytes:
        """Return the bytes of an object's reference. Raises: WireError: It is no object."""

    def read(self, payload: memoryview, offset: int) -> tuple[Any, int]:
        """Return the object at `offset`, and where its reference ends. Raises: WireError: There is none."""


def encode(signature: str, value: Any, *, objects: Objects | None = None, dialect: Dialect = PYTHON) -> list[Buffer]:
    """Return a value of this type as buffers to be sent one after the other; it is converted as libqi does if need be.

    Raises:
        WireError: The signature is invalid, or the value has no form in it.
    """
    return encode_kind(signature, value, objects, dialect)


def encode_arguments(
    parameters: str, arguments: Sequence[Any], *, objects: Objects | None = None, dialect: Dialect = PYTHON
) -> list[Buffer]:
    """Return a call's arguments; `parameters` is a tuple such as "(is)", or "m" for a method that takes anything.

    Raises:
        WireError: They are not as many, or one cannot be converted.
    """
    if parameters == "m":
        return encode_dynamic_arguments(arguments, objects=objects, dialect=dialect)
    return encode_kind(parameters, tuple(arguments), objects, dialect)


def encode_dynamic(
    value: Any, signature: str = "m", *, objects: Objects | None = None, dialect: Dialect = PYTHON
) -> list[Buffer]:
    """Return a value as a dynamic, of this type if one is given.

    Raises:
        WireError: It has no form.
    """
    if signature == "m":
        return encode_kind("m", value, objects, dialect)
    text = signature.encode()
    head = len(text).to_bytes(4, "little") + text
    return [head, *encode_kind(signature, value, objects, dialect)]


def encode_dynamic_arguments(
    arguments: Sequence[Any], *, objects: Objects | None = None, dialect: Dialect = PYTHON
) -> list[Buffer]:
    """Return arguments as one dynamic "(mm..)": the payload of a call with the flag DYNAMIC_PAYLOAD."""
    return encode_dynamic(tuple(arguments), f"({'m' * len(arguments)})", objects=objects, dialect=dialect)


def decode(signature: str, payload: Buffer, *, objects: Objects | None = None) -> Any:
    """Return the value of this type with which a payload begins. What follows is ignored.

    Raises:
        WireError: There is none.
    """
    return decode_from(signature, payload, 0, objects=objects)[0]


def decode_from(signature: str, payload: Buffer, offset: int = 0, *, objects: Objects | None = None) -> tuple[Any, int]:
    """Return the value of this type at `offset`, and where it ends.

    Raises:
        WireError: There is none.
    """
    reader = Reader(payload, objects)
    return reader.read(decoder_of(signature, reader), offset)


def decode_arguments(
    parameters: str, payload: Buffer, flags: int = 0, *, objects: Objects | None = None
) -> tuple[tuple, int]:
    """Return a call's arguments, or an event's values, and where they end.

    Args:
        parameters: "(is)", or "m": anything, as one dynamic.
        flags: Of the message. With DYNAMIC_PAYLOAD the arguments are whatever the sender has sent.

    Raises:
        WireError: They are something else.
    """
    if flags & DYNAMIC_PAYLOAD or parameters == "m":
        value, end = decode_from("m", payload, objects=objects)
        if isinstance(value, dict):
            value = tuple(value.values())
        if not isinstance(value, (tuple, list)):
            raise WireError(f"arguments are a tuple, not {type(value).__name__}")
        return tuple(value), end
    if parse(parameters).code != "(":
        raise WireError(f"Invalid signature {shorten(parameters)}: parameters are a tuple")
    value, end = decode_from(parameters, payload, objects=objects)
    return tuple(value.values()) if isinstance(value, dict) else value, end
