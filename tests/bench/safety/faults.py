"""Faults of the safety benchmark: what sensors, links and clocks do when they fail."""

from __future__ import annotations

import math

import numpy as np

from telepresence.safety import UNKNOWN, Command

BEGINS = (4.0, 10.0)
"""A fault begins at a random time in this interval [s] ..."""
LASTS = 4.0
"""... and lasts this long [s]."""


class Fault:
    """Nothing fails; the base of what does."""

    name = "none"

    def prepare(self, count: int, rng: np.random.Generator) -> None:
        """Choose when it happens in each of `count` places."""
        self.rng = rng
        self._begin = rng.uniform(*BEGINS, count)

    def since(self, now: float) -> np.ndarray:
        """Time since it began in each place; negative where it isn't there [s]."""
        passed = now - self._begin
        return np.where(passed < LASTS, passed, -1.0)

    def active(self, place: int, now: float) -> bool:
        return bool(0.0 <= now - self._begin[place] < LASTS)

    def begin(self, place: int) -> float:
        return float(self._begin[place])

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        """What arrives instead of a measurement; None if nothing does."""
        return ranges

    def commands(self, place: int, now: float, command: Command) -> list[Command]:
        """What arrives instead of a command, oldest first."""
        return [command]

    def clock(self, place: int, now: float) -> float:
        """What the gate's clock shows [s]."""
        return now


class NoFault(Fault):
    def since(self, now: float) -> np.ndarray:
        return np.full(len(self._begin), -1.0)


class Silent(Fault):
    """Every range sensor falls silent."""

    name = "sensors silent"

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        return None if self.active(place, now) else ranges


class Frozen(Fault):
    """Every range sensor repeats its last measurement, freshly stamped."""

    name = "sensors frozen"

    def prepare(self, count: int, rng: np.random.Generator) -> None:
        super().prepare(count, rng)
        self._last: dict[tuple[int, str], np.ndarray] = {}

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        if self.active(place, now):
            return self._last.get((place, name), ranges)
        self._last[place, name] = ranges
        return ranges


class NotANumber(Fault):
    """One reading of every scan is NaN or infinite."""

    name = "NaN and infinity"

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        if not self.active(place, now):
            return ranges
        broken = ranges.copy()
        broken[self.rng.integers(len(broken))] = self.rng.choice([math.nan, math.inf, -math.inf])
        return broken


class MinusOne(Fault):
    """Every reading is -1: the driver has none."""

    name = "all -1"

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        return np.full_like(ranges, UNKNOWN) if self.active(place, now) else ranges


class DeadBeam(Fault):
    """One beam of each source sees nothing from the start: for the gate that is free space."""

    name = "one dead beam"

    def ranges(self, place: int, now: float, name: str, ranges: np.ndarray) -> np.ndarray | None:
        broken = ranges.copy()
        broken[place % len(broken)] = 10.0
        return broken


class CommandLoss(Fault):
    """Half of the commands are lost, all the time."""

    name = "half the commands lost"

    def commands(self, place: int, now: float, command: Command) -> list[Command]:
        return [command] if self.rng.random() < 0.5 else []


class LinkCut(Fault):
    """No command comes."""

    name = "link cut"

    def commands(self, place: int, now: float, command: Command) -> list[Command]:
        return [] if self.active(place, now) else [command]


class Burst(Fault):
    """The link stalls for two seconds at a time, then everything that waited comes at once."""

    name = "stalls and bursts"
    STALL = 2.0

    def prepare(self, count: int, rng: np.random.Generator) -> None:
        super().prepare(count, rng)
        self._queue: list[list[Command]] = [[] for _ in range(count)]

    def commands(self, place: int, now: float, command: Command) -> list[Command]:
        self._queue[place].append(command)
        if self.active(place, now) and (now - self._begin[place]) % (self.STALL + 0.5) < self.STALL:
            return []
        queue, self._queue[place] = self._queue[place], []
        return queue


class ClockJump(Fault):
    """The clock jumps by ten seconds, forward in one half of the places and back in the other."""

    name = "clock jumps 10 s"

    def clock(self, place: int, now: float) -> float:
        jump = 10.0 if place % 2 else -10.0
        return now + (jump if now >= self._begin[place] else 0.0)


NO_FAULT = NoFault()
FAULTS = (Silent, Frozen, NotANumber, MinusOne, DeadBeam, CommandLoss, LinkCut, Burst, ClockJump)
MUST_STOP = (Silent, Frozen, NotANumber, MinusOne, LinkCut)
"""Faults after whose beginning the robot must soon stand still."""
