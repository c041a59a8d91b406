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
_LONG = 16384
"""From this size a payload is received straight into its own buffer [bytes]."""
_STEP = 65536
"""A long payload's buffer is at most this much larger than what has arrived, or twice as large [bytes]."""

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

    Holds what has arrived of one message; for a long payload at most twice as much. One thread at a time.

        view = reader.tail()                   # a long payload is under way: receive into it
        if view is None:
            messages = reader.feed(scratch[: socket.recv_into(scratch)])
        else:
            messages = reader.filled(socket.recv_into(view))
        for header, payload in messages: ...   # to its end, before anything else is asked of the reader

    Args:
        max_payload: Messages with more are refused [bytes]; may be changed at any time, for those to come.
    """

    def __init__(self, max_payload: int = MAX_PAYLOAD) -> None:
        self.max_payload = max_payload
        self._pending = bytearray()
        self._header: Header | None = None
        self._payload: bytearray | None = None
        self._arrived = 0
        self._view: memoryview | None = None

    @property
    def idle(self) -> bool:
        """Whether no message is half received."""
        return not self._pending and self._payload is None

    def feed(self, data: bytes | bytearray | memoryview) -> Iterator[tuple[Header, Payload]]:
        """Yield the messages that these bytes complete. Nothing of `data` is kept afterwards.

        Raises:
            WireError: After the good messages before it, one with another magic number or too long a payload. The
                connection is to be closed; the reader is of no use any more.
        """
        view = memoryview(data)
        while len(view):
            if self._payload is not None and self._header is not None:
                size = min(len(view), self._header.size - self._arrived)
                self._grow(self._arrived + size)
                self._payload[self._arrived : self._arrived + size] = view[:size]
                view = view[size:]
                yield from self.filled(size)
                continue
            if self._pending:  # complete the header first, then the payload
                missing = HEADER_SIZE - len(self._pending)
                if missing <= 0 and self._header is not None:
                    missing += self._header.size
                piece, view = view[:missing], view[missing:]
                self._pending += piece
                if len(piece) < missing:
                    return
                header = self._header or self._check(Header.unpack(self._pending))
                if len(self._pending) == HEADER_SIZE + header.size:
                    payload = bytes(memoryview(self._pending)[HEADER_SIZE:])
                    self._pending, self._header = bytearray(), None
                    yield header, payload
                else:
                    self._begin(header)
                continue
            if len(view) < HEADER_SIZE:
                self._pending += view
                return
            header = self._check(Header.unpack(view))
            end = HEADER_SIZE + header.size
            if end <= len(view):
                payload = bytes(view[HEADER_SIZE:end])
                view = view[end:]
                yield header, payload
            else:
                self._pending += view[:HEADER_SIZE]
                view = view[HEADER_SIZE:]
                self._begin(header)

    def tail(self) -> memoryview | None:
        """Return where to receive the next bytes of a long payload, None if none is under way: then `feed`."""
        if self._payload is None:
            return None
        if self._view is None:
            if self._arrived == len(self._payload):
                self._grow(self._arrived + 1)
            self._view = memoryview(self._payload)[self._arrived :]
        return self._view

    def filled(self, size: int) -> Iterator[tuple[Header, Payload]]:
        """Yield the message, if the bytes received into `tail` complete it."""
        if self._view is not None:
            self._view.release()
            self._view = None
        self._arrived += size
        header, payload = self._header, self._payload
        if header is not None and payload is not None and self._arrived == header.size:
            self._header = self._payload = None
            yield header, payload

    def _check(self, header: Header) -> Header:
        if header.size > self.max_payload:
            raise WireError(f"a payload of {header.size} bytes is announced, {self.max_payload} are allowed")
        return header

    def _begin(self, header: Header) -> None:
        """Wait for the payload of this header, which is all that is pending."""
        self._header = header
        if header.size >= _LONG:
            self._pending = bytearray()
            self._payload = bytearray()
            self._arrived = 0

    def _grow(self, size: int) -> None:
        """Make the payload's buffer hold so many bytes, which are about to arrive, and some more."""
        if self._payload is not None and self._header is not None and size > len(self._payload):
            size = min(self._header.size, max(size, _STEP + self._arrived, 2 * self._arrived))
            self._payload.extend(bytes(size - len(self._payload)))
