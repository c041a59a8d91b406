"""Messages of NAOqi's messaging: a header of 28 bytes, little-endian, then the payload.

    magic 42 DE AD 42 | uint32 id | uint32 payload size | uint16 version 0 | uint8 kind | uint8 flags
    | uint32 service | uint32 object | uint32 action

A reply repeats id, service, object and action of its call. Source: libqi 4.0 (BSD-3-Clause), src/messaging/message.hpp.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple, Union

from .signature import WireError

MAGIC = 0x42ADDE42
HEADER_SIZE = 28
CALL, REPLY, ERROR, POST, EVENT, CAPABILITY, CANCEL, CANCELED = range(1, 9)
DYNAMIC_PAYLOAD, RETURN_TYPE = 1, 2
"""Flags: the payload is one dynamic; after the arguments stands the signature that the caller wants to be given."""
MAX_PAYLOAD = 64 << 20
"""Bytes, unless a connection sets another limit."""

_HEADER = struct.Struct("<IIIHBBIII")

Payload = Union[bytes, bytearray]


class Header(NamedTuple):
    """One message's header. kind: CALL ...; flags: DYNAMIC_PAYLOAD | RETURN_TYPE; size: of the payload [bytes]."""

    identity: int
    size: int
    kind: int
    flags: int
    service: int
    object: int
    action: int
    version: int = 0

    def pack(self) -> bytes:
        """Return the 28 bytes.

        Raises:
            WireError: A field is out of range.
        """
        identity, size, kind, flags, service, obj, action, version = self
        try:
            return _HEADER.pack(MAGIC, identity, size, version, kind, flags, service, obj, action)
        except struct.error as error:
            raise WireError(f"{self} does not fit a header: {error}") from None

    @classmethod
    def unpack(cls, data: bytes | bytearray | memoryview, offset: int = 0) -> Header:
        """Read a header. Kind, flags and version may be any: to refuse them is the receiver's matter.

        Raises:
            WireError: These are not 28 bytes, or the magic number is another.
        """
        try:
            magic, identity, size, version, kind, flags, service, obj, action = _HEADER.unpack_from(data, offset)
        except struct.error:
            raise WireError(f"a header has {HEADER_SIZE} bytes, not {len(data) - offset}") from None
        if magic != MAGIC:
            raise WireError(f"no NAOqi message: it begins with {struct.pack('<I', magic).hex(' ')}")
        return cls(identity, size, kind, flags, service, obj, action, version)


class MessageReader:
    """Assembles messages from bytes as they arrive, in pieces of any size.

    Holds what has arrived of one message, and little more than that. One thread at a time.

        for header, payload in reader.feed(scratch[: socket.recv_into(scratch)]): ...   # to its end, before the next

    Args:
        max_payload: Messages with more are refused [bytes]; may be changed at any time, for those to come.
    """

    def __init__(self, max_payload: int = MAX_PAYLOAD) -> None:
        self.max_payload = max_payload
        self._pending = bytearray()
        self._header: Header | None = None

    @property
    def idle(self) -> bool:
        """Whether no message is half received."""
        return not self._pending and self._header is None

    def feed(self, data: bytes | bytearray | memoryview) -> Iterator[tuple[Header, Payload]]:
        """Yield the messages that these bytes complete. Nothing of `data` is kept afterwards.

        Raises:
            WireError: After the good messages before it, one with another magic number or too long a payload. The
                connection is to be closed; the reader is of no use any more.
        """
        view = memoryview(data)
        while True:
            header = self._header
            if header is None:
                if not self._pending and len(view) >= HEADER_SIZE:
                    header = self._check(Header.unpack(view))
                    view = view[HEADER_SIZE:]
                else:
                    missing = HEADER_SIZE - len(self._pending)
                    self._pending += view[:missing]
                    if len(view) < missing:
                        return
                    view = view[missing:]
                    header = self._check(Header.unpack(self._pending))
                    self._pending = bytearray()
                self._header = header
            payload: Payload
            if not self._pending and len(view) >= header.size:
                payload, view = bytes(view[: header.size]), view[header.size :]
            else:
                missing = header.size - len(self._pending)
                self._pending += view[:missing]
                if len(view) < missing:
                    return
                payload, view = self._pending, view[missing:]
                self._pending = bytearray()
            self._header = None
            yield header, payload

    def _check(self, header: Header) -> Header:
        if header.size > self.max_payload:
            raise WireError(f"a payload of {header.size} bytes is announced, {self.max_payload} are allowed")
        return header
