"""A recorded session as arrays, and the figures that summarize it. No ROS, no Qt."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

MOVING = 0.02
"""[m/s]; slower counts as standing still."""
LONGEST_TICK = 0.3
"""[s]; a decision counts for no longer than this, even when the next one comes later."""


@dataclass(frozen=True)
class Stop:
    """A stretch in which the safety gate was in one state: from `start`, for `duration` [s]."""

    state: str
    reason: str
    start: float
    duration: float


@dataclass(frozen=True, eq=False)
class Session:
    """A recorded session. Times are seconds since `start` [s since 1970]; positions are in odom.

    Args:
        path: (n, 4) t, x, y [m], heading [rad].
        commands: (n, 4) t, forward, left [m/s], counter-clockwise [rad/s]: what the pilot asked for.
        safety: (n, 5) t, what the wheels were given (as in commands), gap [m].
        states, reasons: The safety gate's, one for each row of `safety`.
        pictures: (n, 2) t, age on arrival [s].
        battery: (n, 3) t, charge (0 to 1) or NaN, voltage [V].
    """

    start: float
    duration: float
    path: np.ndarray = field(repr=False)
    commands: np.ndarray = field(repr=False)
    safety: np.ndarray = field(repr=False)
    states: tuple[str, ...] = field(repr=False)
    reasons: tuple[str, ...] = field(repr=False)
    pictures: np.ndarray = field(repr=False)
    battery: np.ndarray = field(repr=False)
    messages: int = 0

    def distance(self) -> float:
        """Return the distance driven [m], without the jitter of a standing robot."""
        if len(self.path) < 2:
            return 0.0
        total, last = 0.0, self.path[0, 1:3]
        for place in self.path[1:, 1:3]:
            step = float(np.linalg.norm(place - last))
            if step > 0.01:
                total, last = total + step, place
        return total

    def top_speed(self) -> float:
        """Return the highest speed that the wheels were given [m/s]."""
        return float(np.hypot(self.safety[:, 1], self.safety[:, 2]).max()) if len(self.safety) else 0.0

    def nearest(self) -> float:
        """Return the least distance to anything [m]; NaN if none is known."""
        gaps = self.safety[:, 4]
        gaps = gaps[np.isfinite(gaps)]
        return float(gaps.min()) if len(gaps) else float("nan")

    def passed(self) -> float:
        """Return the share of the wanted speed that reached the wheels while the pilot drove; NaN if nobody did."""
        if not len(self.commands) or not len(self.safety):
            return float("nan")
        index = np.searchsorted(self.commands[:, 0], self.safety[:, 0], side="right") - 1
        fresh = (index >= 0) & (self.safety[:, 0] - self.commands[np.maximum(index, 0), 0] < LONGEST_TICK)
        wanted = np.where(fresh, np.hypot(*self.commands[np.maximum(index, 0), 1:3].T), 0.0)
        given = np.hypot(self.safety[:, 1], self.safety[:, 2])
        driving = wanted > MOVING
        if not driving.any():
            return float("nan")
        return float(np.minimum(given[driving], wanted[driving]).sum() / wanted[driving].sum())

    def stops(self, states: frozenset[str]) -> list[Stop]:
        """Return the stretches in which the safety gate was in one of these states, in order."""
        found: list[Stop] = []
        for first, last in self._runs():
            if self.states[first] in states:
                end = self.safety[last, 0] + min(LONGEST_TICK, self._period())
                start = float(self.safety[first, 0])
                found.append(Stop(self.states[first], self.reasons[first], start, float(end - start)))
        return found

    def time_in_states(self) -> dict[str, float]:
        """Return the seconds that the safety gate spent in each state."""
        total: dict[str, float] = defaultdict(float)
        period = self._period()
        for state in self.states:
            total[state] += period
        return dict(total)

    def picture_rate(self) -> np.ndarray:
        """Return (n, 2) t, number of pictures in the second before."""
        if not len(self.pictures):
            return np.empty((0, 2))
        seconds = np.arange(1.0, max(2.0, self.duration))
        t = self.pictures[:, 0]
        counts = np.searchsorted(t, seconds) - np.searchsorted(t, seconds - 1.0)
        return np.stack([seconds, counts], axis=1)

    def _runs(self) -> Iterator[tuple[int, int]]:
        first = 0
        for index in range(1, len(self.states) + 1):
            if index == len(self.states) or self.states[index] != self.states[first]:
                yield first, index - 1
                first = index

    def _period(self) -> float:
        return float(np.median(np.diff(self.safety[:, 0]))) if len(self.safety) > 1 else 0.0
