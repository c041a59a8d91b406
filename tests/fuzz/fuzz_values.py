"""Python values out of bytes, for what libraries have parsed already: NAOqi's replies, the fields of a ROS message."""

from __future__ import annotations

import math
import struct
from typing import Any

TEXTS = ("", "LArm", "\0", "\ud800", "é" * 200, "\u202e", "%s", "<b>", "A" * 5000)
NUMBERS = (0, 1, -1, 2**31, 2**63, -(2**63), 2**64 - 1, math.nan, math.inf, -math.inf, 1e-320, 1e308, True, None)


class Values:
    """Takes values from the front of `data`; what is missing reads as zeros."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def take(self, count: int) -> bytes:
        """Return the next bytes."""
        piece = self._data[self._at : self._at + count]
        self._at += count
        return piece.ljust(count, b"\0")

    def byte(self) -> int:
        return self.take(1)[0]

    def rest(self) -> bytes:
        """Return all bytes that are left."""
        piece, self._at = self._data[self._at :], len(self._data)
        return piece

    def number(self) -> float:
        return struct.unpack("<d", self.take(8))[0]

    def whole(self) -> int:
        return struct.unpack("<q", self.take(8))[0]

    def text(self) -> str:
        """Return a text, with unpaired surrogates at times."""
        return self.take(self.byte()).decode("utf-8", "surrogateescape")

    def value(self, depth: int = 0) -> Any:
        """Return anything: a number, a text, bytes, a list, nothing."""
        kind = self.byte()
        if kind < 64:
            return self.number()
        if kind < 96:
            return self.whole()
        if kind < 144:
            return NUMBERS[kind % len(NUMBERS)]
        if kind < 176:
            return self.text()
        if kind < 192:
            return TEXTS[kind % len(TEXTS)]
        if kind < 208:
            return self.take(kind % 16)
        return [self.value(depth + 1) for _ in range(kind % 12)] if depth < 5 else []

    def values(self, count: int) -> list[Any]:
        return [self.value() for _ in range(count)]


def packed(*numbers: float) -> bytes:
    """Return bytes from which `Values.value` reads these numbers."""
    return b"".join(b"\0" + struct.pack("<d", number) for number in numbers)
