"""Inputs for parsers: valid ones, damaged in every way that has broken parsers before, and some from nothing."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Sequence
from typing import Any

NUMBERS = (
    *("0", "-0", "-1", "0.1", "1e999", "-1e999", "1e-999", "NaN", "Infinity", "-Infinity", "0x10", "1_0", "01", "+1"),
    *(str(2**bits + more) for bits in (7, 8, 15, 16, 31, 32, 53, 63, 64, 1024) for more in (-1, 0)),
    *("9" * 400, "9" * 5000, "1e" + "9" * 30, "0." + "0" * 400 + "1", "١٢٣", "²", "1.7976931348623157e308"),
)
"""What stands where a number is expected."""
TEXTS = (
    *("", "\0", "\r\n", "\r\nX: y", "%s%n%x", "${time}", "{0}", "<img src=x onerror=y>", "../../etc/passwd", "null"),
    *("\x1b]0;x\7", "\u202e", "\ufeff", "\u2028", "é" * 100, "e" + "\u0301" * 200, "\U0001f600", "A" * 1000),
    *("''--", "ﬀ", "İ"),
)
BYTES = (b"\0", b"\xff", b"\xff" * 16, b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xef\xbb\xbf", b"\\ud800")
"""Bytes that are no UTF-8, byte order marks, and half a pair in JSON."""
DEPTHS = (10, 100, 900, 3000, 100_000)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")


class Mutator:
    """Makes inputs; the same ones for the same seed.

    Args:
        seeds: Valid inputs.
        longest: Of an input [bytes].
        seed: Of the random numbers.
    """

    def __init__(self, seeds: Sequence[bytes], longest: int, seed: int) -> None:
        self._seeds = seeds
        self._longest = longest
        self._random = random.Random(seed)

    def new(self) -> bytes:
        """Return another input."""
        if self._random.random() < 0.05:
            return self._random.randbytes(self._random.choice((0, 1, 7, 64, 300)))[: self._longest]
        data = self._random.choice(self._seeds)
        while True:
            data = self.changed(data)
            if self._random.random() < 0.6:
                return data

    def changed(self, data: bytes) -> bytes:
        """Return `data` with one change."""
        change: Callable[[bytes], bytes] = self._random.choice(
            (
                self._flip,
                self._cut,
                self._remove,
                self._repeat,
                self._splice,
                self._insert,
                self._number,
                self._length,
                self._nest,
                self._line,
                self._value,
                self._value,
            )
        )
        return change(data)[: self._longest]

    def _span(self, data: bytes) -> tuple[int, int]:
        begin = self._random.randint(0, len(data))
        return begin, min(len(data), begin + int(self._random.paretovariate(0.7)))

    def _flip(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(self._random.randint(1, 4)):
            if changed:
                changed[self._random.randrange(len(changed))] ^= 1 << self._random.randrange(8)
        return bytes(changed)

    def _cut(self, data: bytes) -> bytes:
        return data[: self._random.randint(0, len(data))]

    def _remove(self, data: bytes) -> bytes:
        begin, end = self._span(data)
        return data[:begin] + data[end:]

    def _repeat(self, data: bytes) -> bytes:
        begin, end = self._span(data)
        times = self._random.choice((2, 3, 20, 1 + self._longest // (1 + end - begin)))
        return data[:begin] + data[begin:end] * times + data[end:]

    def _splice(self, data: bytes) -> bytes:
        other = self._random.choice(self._seeds)
        return data[: self._random.randint(0, len(data))] + other[self._random.randint(0, len(other)) :]

    def _insert(self, data: bytes) -> bytes:
        at, end = self._span(data)
        piece = self._random.choice((self._random.choice(BYTES), self._random.choice(TEXTS).encode()))
        return data[:at] + piece + data[self._random.choice((at, end)) :]

    def _number(self, data: bytes) -> bytes:
        places = [found.span() for found in _NUMBER.finditer(data)]
        if not places:
            return self._insert(data)
        begin, end = self._random.choice(places)
        return data[:begin] + self._random.choice(NUMBERS).encode() + data[end:]

    def _length(self, data: bytes) -> bytes:
        size = self._random.choice((1, 2, 4, 8))
        at = self._random.randint(0, max(0, len(data) - size))
        most = (1 << 8 * size) - 1
        value = self._random.choice((0, 1, most, most >> 1, (most >> 1) + 1, len(data) & most, (len(data) - at) & most))
        return data[:at] + value.to_bytes(size, self._random.choice(("big", "little"))) + data[at + size :]

    def _nest(self, data: bytes) -> bytes:
        depth = self._random.choice(DEPTHS)
        opening, closing = self._random.choice(((b"[", b"]"), (b'{"a":', b"}"), (b"(", b")"), (b"<a>", b"</a>")))
        at, end = self._span(data)
        return data[:at] + opening * depth + self._random.choice((b"", b"1" + closing * depth)) + data[end:]

    def _line(self, data: bytes) -> bytes:
        lines = data.split(b"\n")
        at, to = self._random.randrange(len(lines)), self._random.randrange(len(lines))
        line = lines.pop(at)
        for _ in range(self._random.choice((0, 1, 2, 50))):
            lines.insert(to, line)
        return b"\n".join(lines)

    def _value(self, data: bytes) -> bytes:
        """Change one value of a JSON text, which stays one."""
        try:
            value = json.loads(data)
        except (ValueError, RecursionError):
            return self._flip(data)
        return json.dumps(self._other(value), ensure_ascii=self._random.random() < 0.5).encode("utf-8", "surrogatepass")

    def _other(self, value: Any) -> Any:
        if isinstance(value, dict) and value and self._random.random() < 0.9:
            name = self._random.choice(list(value))
            kept = {each: part for each, part in value.items() if each != name}
            if self._random.random() < 0.15:
                return kept
            if self._random.random() < 0.05:
                name = self._random.choice(TEXTS)
            return {**kept, name: self._other(value.get(name))}
        if isinstance(value, list) and value and self._random.random() < 0.8:
            at = self._random.randrange(len(value))
            if self._random.random() < 0.15:
                return value[:at] + value[at + 1 :]
            return [*value[:at], self._other(value[at]), *value[at + 1 :]]
        return self.any_value()

    def any_value(self, depth: int = 0) -> Any:
        """Return something that JSON can say, or nearly."""
        number = self._random.choice(NUMBERS)
        kinds: tuple[Callable[[], Any], ...] = (
            lambda: None,
            lambda: self._random.choice((True, False)),
            lambda: self._random.choice((0, 1, -1, 3.5, 2**31, 2**53, 2**64, 10**400, float("nan"), float("inf"))),
            lambda: self._random.gauss(0, 1e3),
            lambda: number,
            lambda: self._random.choice((*TEXTS, "\ud800", "drive", "stop")),
            lambda: [self.any_value(depth + 1) for _ in range(self._random.choice((0, 1, 3, 9)))] if depth < 4 else [],
            lambda: {self._random.choice(TEXTS): self.any_value(depth + 1)} if depth < 4 else {},
        )
        return self._random.choice(kinds)()
