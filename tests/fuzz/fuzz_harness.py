"""What must hold for every input of a parser: only the documented exception, in bounded time, and nothing is kept.

A target is a parser with valid inputs to begin from. `Checker` judges one input, `run` feeds many that `fuzz_mutations`
makes; `fuzz_guided` has atheris choose them by what they reach.
"""

from __future__ import annotations

import gc
import hashlib
import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from fuzz_mutations import Mutator

FOUND = Path(__file__).with_name("found")
"""A folder for each target, with the inputs that once broke something."""
SLOWEST = 100.0
"""An input may take as many times as long as a valid one, and more in proportion if it is longer."""
SHORTEST = 0.01
"""Below this no input counts as slow [s of processor time]: a garbage collection takes as long."""
MOST_GROWTH = 64 << 20
"""Memory that a run may need more at its end than after its first tenth [bytes]."""
MOST_OBJECTS = 2000
"""Python objects that a run may leave, besides one in a hundred inputs."""


@dataclass(frozen=True)
class Target:
    """A parser of bytes from outside.

    Args:
        feed: Takes an input.
        seeds: Valid inputs.
        refuses: What `feed` may raise.
        longest: Longest input that is made [bytes].
        heaviest: The valid input that takes longest, if that does not show in its length: a large picture.
    """

    feed: Callable[[bytes], object]
    seeds: Sequence[bytes]
    refuses: tuple[type[BaseException], ...] = ()
    longest: int = 4096
    heaviest: bytes | None = None


class Find(Exception):
    """An input broke what must hold; the text says how.

    Args:
        data: The input.
    """

    def __init__(self, text: str, data: bytes) -> None:
        super().__init__(text)
        self.data = data

    def save(self, name: str, folder: Path = FOUND) -> Path:
        """Write the input to where a test replays it; the file."""
        path = folder / name / f"{hashlib.sha256(self.data).hexdigest()[:16]}.bin"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.data)
        return path


class Report(NamedTuple):
    """How a run went: inputs, seconds, growth of memory [bytes] and the longest time of an input [s]."""

    inputs: int
    seconds: float
    growth: int
    slowest: float


class Checker:
    """Feeds a target and raises `Find`.

    Raises:
        Find: A valid input is refused already.
    """

    def __init__(self, target: Target, inputs: int) -> None:
        self._target = target
        self._inputs = inputs
        self._count = 0
        self._resident = self._objects = 0
        self.slowest = 0.0
        self._begin = time.monotonic()
        for seed in target.seeds:  # the first time imports and fills caches
            self._feed(seed, valid=True)
        self._size = max(map(len, target.seeds))
        self._limit = max(SHORTEST, SLOWEST * max(self._least_time(seed) for seed in target.seeds))
        if target.heaviest is not None:
            self._limit = max(self._limit, 3.0 * self._feed(target.heaviest, valid=True))

    def __call__(self, data: bytes) -> None:
        took = self._feed(data)
        limit = self._limit * max(1.0, len(data) / self._size)
        if took > limit:
            took = self._least_time(data)  # what else this machine does counts as well
            if took > limit:
                raise Find(f"{len(data)} bytes take {took:.3f} s; {limit:.3f} s are allowed", data)
        self.slowest = max(self.slowest, took)
        self._count += 1
        if self._count == 1 + self._inputs // 10:
            self._resident, self._objects = _resident(), _objects()

    def finish(self) -> Report:
        """Return how it went.

        Raises:
            Find: Memory has grown.
        """
        objects = _objects() - self._objects
        growth = _resident() - self._resident
        if growth > MOST_GROWTH or objects > MOST_OBJECTS + self._count // 100:
            raise Find(f"after {self._count} inputs {growth / 1e6:.0f} MB and {objects} objects more are held", b"")
        return Report(self._count, time.monotonic() - self._begin, growth, self.slowest)

    def _feed(self, data: bytes, valid: bool = False) -> float:
        begin = time.thread_time()
        try:
            self._target.feed(data)
        except self._target.refuses as error:
            if valid:
                raise Find(f"a valid input is refused: {error!r}", data) from error
        except Exception as error:
            raise Find(f"{type(error).__name__}: {error}"[:2000], data) from error
        return time.thread_time() - begin

    def _least_time(self, data: bytes) -> float:
        return min(self._feed(data) for _ in range(3))


def run(target: Target, inputs: int, seed: int) -> Report:
    """Feed as many inputs.

    Raises:
        Find: One broke what must hold.
    """
    with quiet():
        checker = Checker(target, inputs)
        mutator = Mutator(target.seeds, target.longest, seed)
        for _ in range(inputs):
            checker(mutator.new())
        return checker.finish()


def found(name: str) -> Iterator[Path]:
    """Yield the inputs that once broke a target."""
    yield from sorted((FOUND / name).glob("*.bin"))


@contextmanager
def quiet() -> Iterator[None]:
    """Write no log meanwhile: a million refusals are of no interest."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _objects() -> int:
    gc.collect()
    return len(gc.get_objects())
