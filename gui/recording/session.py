"""A recorded session as arrays, and what is told about it in figures. No ROS, no Qt."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

MOVING = 0.02
"""[m/s]; slower counts as standing."""
LONGEST_TICK = 0.3
"""Seconds; a decision counts no longer than this, whatever comes after it."""


@dataclass(frozen=True)
class Stop:
    """The safety gate took all of the motion, or the pilot was stopped: from `start`, for `duration` [s]."""

    state: str
    reason: str
    start: float
    duration: float


@dataclass(frozen=True, eq=False)
class Session:
    """Times are seconds since `start` [s since 1970]; places are in odom.

    Args:
        path: (n, 4) t, x, y [m], heading [rad].
        commands: (n, 4) t, forward, left [m/s], counter-clockwise [rad/s]: what the pilot wanted.
        safety: (n, 5) t, what the wheels were given (as in commands), gap [m].
        states, reasons: Of the safety gate, one for each row of `safety`.
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
        """Driven [m]; without the jitter of a standing robot."""
        if len(self.path) < 2:
            return 0.0
        total, last = 0.0, self.path[0, 1:3]
        for place in self.path[1:, 1:3]:
            step = float(np.linalg.norm(place - last))
            if step > 0.01:
                total, last = total + step, place
        return total

    def top_speed(self) -> float:
        """Fastest that the wheels were told to go [m/s]."""
        return float(np.hypot(self.safety[:, 1], self.safety[:, 2]).max()) if len(self.safety) else 0.0

    def nearest(self) -> float:
        """Least free room while recording [m]; NaN if none is known."""
        gaps = self.safety[:, 4]
        gaps = gaps[np.isfinite(gaps)]
        return float(gaps.min()) if len(gaps) else float("nan")

    def passed(self) -> float:
        """Share of the wanted speed that reached the wheels while the pilot wanted to drive; NaN if never."""
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
        """The stretches in which the safety gate was in one of these states, in order."""
        found: list[Stop] = []
        for first, last in self._runs():
            if self.states[first] in states:
                end = self.safety[last, 0] + min(LONGEST_TICK, self._period())
                start = float(self.safety[first, 0])
                found.append(Stop(self.states[first], self.reasons[first], start, float(end - start)))
        return found

    def time_in_states(self) -> dict[str, float]:
        """State of the safety gate -> seconds."""
        total: dict[str, float] = defaultdict(float)
        period = self._period()
        for state in self.states:
            total[state] += period
        return dict(total)

    def picture_rate(self) -> np.ndarray:
        """(n, 2) t, pictures in the second before."""
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
