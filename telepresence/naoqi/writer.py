"""Where encoders put what they make: pieces of bytes, raw data as it is, and objects that are given away at the end."""

from __future__ import annotations

from typing import Any, NamedTuple

from .dynamics import Dialect
from .signature import MAX_DEPTH, WireError


class Reference(NamedTuple):
    """An object among what was written. Only when all the rest has a form is it given away: that cannot be undone."""

    value: Any


class Writer:
    """What encoders write to.

    append: Takes bytes, a memoryview of raw data that is not to be copied (and sets `long`), or a Reference (and sets
        `refers`).
    dynamics: The encoder of a dynamic by the type of its value, in this dialect.
    level: How deep the dynamic is that is being written.
    """

    __slots__ = ("append", "dialect", "dynamics", "level", "long", "objects", "parts", "refers")

    def __init__(self, objects: Any, dialect: Dialect, dynamics: dict[type, Any]) -> None:
        self.parts: list[Any] = []
        self.append = self.parts.append
        self.objects = objects
        self.dialect = dialect
        self.dynamics = dynamics
        self.level = 0
        self.long = self.refers = False

    def deeper(self, depth: int) -> None:
        """Enter a dynamic that is so deep; take it off `level` afterwards.

        Raises:
            WireError: That is too deep.
        """
        self.level += depth
        if self.level > MAX_DEPTH:
            raise WireError(f"values are nested deeper than {MAX_DEPTH}")

    def buffers(self) -> list[Any]:
        """Return what was written, long raw data as it is and all between in one piece."""
        if self.refers:
            write = self.objects.write
            self.parts = [write(part.value) if type(part) is Reference else part for part in self.parts]
        if not self.long:
            return [b"".join(self.parts)]
        buffers: list[Any] = []
        short: list[bytes] = []
        for part in self.parts:
            if type(part) is memoryview:
                buffers += (b"".join(short), part)
                short = []
            else:
                short.append(part)
        if short:
            buffers.append(b"".join(short))
        return buffers
