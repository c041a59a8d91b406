"""Splits multipart/x-mixed-replace while it arrives, as a browser does, with a limit on the size of a part.

Servers differ: the boundary may or may not repeat the two dashes in the header, lines may end in LF alone, a part may
state its length or end at the next delimiter.
"""

from __future__ import annotations

import re

_HEAD_LIMIT = 16384
_HEAD_END = re.compile(rb"\r?\n\r?\n")
_LENGTH = re.compile(rb"(?im)^content-length[ \t]*:[ \t]*(\d{1,12})[ \t]*\r?$")


class MalformedStream(ValueError):
    """The bytes are not a multipart stream, or a part is larger than allowed."""


class MultipartParser:
    """Takes bytes and returns the bodies of complete parts.

    Args:
        boundary: From the Content-Type header.
        limit: Largest body [bytes].
    """

    def __init__(self, boundary: str, limit: int) -> None:
        if not boundary:
            raise MalformedStream("the Content-Type names no boundary")
        name = boundary.encode("latin-1", "replace")
        self._delimiter = name if name.startswith(b"--") else b"--" + name
        self._limit = limit
        self._buffer = bytearray()
        self._scanned = 0  # bytes of the buffer in which no delimiter begins
        self._in_part = False
        self._body_start = 0
        self._length: int | None = None

    def feed(self, data: bytes) -> list[bytes]:
        """Add received bytes and return the bodies that are complete now, oldest first.

        Raises:
            MalformedStream: No delimiter or end of headers where there should be one, or a body above the limit.
        """
        self._buffer += data
        bodies: list[bytes] = []
        while self._step(bodies):
            pass
        return bodies

    def _step(self, bodies: list[bytes]) -> bool:
        if not self._in_part:
            return self._begin_part()
        if self._length is not None:
            end = self._body_start + self._length
            if len(self._buffer) < end:
                return False
            self._finish_part(bodies, end)
            return True
        start = max(self._body_start, self._scanned)
        found = self._buffer.find(self._delimiter, start)
        if found < 0:
            if len(self._buffer) - self._body_start > self._limit + len(self._delimiter) + 2:
                raise MalformedStream(f"a picture has more than {self._limit} bytes")
            self._scanned = max(self._body_start, len(self._buffer) - len(self._delimiter) + 1)
            return False
        end = found
        for line_end in (b"\r\n", b"\n"):
            if self._buffer.endswith(line_end, self._body_start, found):
                end = found - len(line_end)
                break
        self._finish_part(bodies, end)
        return True

    def _begin_part(self) -> bool:
        found = self._buffer.find(self._delimiter)
        if found < 0:
            if len(self._buffer) > _HEAD_LIMIT:
                raise MalformedStream(f"no boundary within {_HEAD_LIMIT} bytes")
            return False
        if self._buffer.startswith(b"--", found + len(self._delimiter)):
            raise MalformedStream("the stream has ended")
        head_start = found + len(self._delimiter)
        end = _HEAD_END.search(self._buffer, head_start)
        if end is None:
            if len(self._buffer) - found > _HEAD_LIMIT:
                raise MalformedStream(f"a part's headers have more than {_HEAD_LIMIT} bytes")
            return False
        length = _LENGTH.search(self._buffer, head_start, end.start())
        self._length = int(length[1]) if length else None
        if self._length is not None and self._length > self._limit:
            raise MalformedStream(f"a picture of {self._length} bytes is above the limit of {self._limit}")
        self._body_start = end.end()
        self._scanned = 0
        self._in_part = True
        return True

    def _finish_part(self, bodies: list[bytes], end: int) -> None:
        bodies.append(bytes(self._buffer[self._body_start : end]))
        del self._buffer[:end]
        self._in_part = False
