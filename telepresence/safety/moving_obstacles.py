"""Somebody is coming: what has moved between two scans of a laser, and how fast.

A return where the floor was free a moment ago, and an earlier one near by that is gone, are one thing that has walked
from there to here. Things that memory knows well don't count: thin legs come and go between the beams.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from .obstacle_memory import ObstacleMemory
from .plane import squared_distances, squared_lengths
from .scan import Scan

REACH = 2.5
"""Farther movers don't matter yet [m]."""
OFTEN = 0.09
"""Scans that follow sooner than this are left out: persons don't get far in it [s]."""
BETWEEN = 0.40
"""Scans are compared over at least this time [s] ..."""
KEEP = 0.8
"""... and at most this [s]."""
GOES_ON = 0.1
"""Two such findings at least this far apart must show it going on ..."""
PERSISTS = 0.3
"""... and at most this; for so long it is also believed when it isn't recognised again [s]."""
OFF_COURSE = 0.20
"""It may have strayed this far from where its velocity would have brought it [m]."""
FARTHER = 0.12
"""A place was free if the beams to both sides of it read this much farther [m]."""
BESIDE = math.sin(0.2)
"""Sine of the widest angle between a place and the beams to both sides of it."""
KNOWN = 0.08
"""An obstacle within this distance explains a return [m]."""
WELL_KNOWN = 6
"""Sightings that make an obstacle well known."""
FASTEST = 2.0
"""Persons don't walk faster [m/s]; ISO 13855 counts with 1.6."""


class MovingObstacles:
    """Moving returns of the newest scans of each source, odometry frame."""

    def __init__(self) -> None:
        self._scans: dict[str, deque[tuple[float, Scan]]] = {}
        self._guesses: dict[str, deque[tuple[float, np.ndarray]]] = {}
        self._found: dict[str, tuple[float, np.ndarray, np.ndarray]] = {}

    def clear(self) -> None:
        self._scans.clear()
        self._guesses.clear()
        self._found.clear()

    def observe(self, name: str, stamp: float, scan: Scan, robot: np.ndarray, memory: ObstacleMemory) -> None:
        """Compare a scan with an earlier one of the same source.

        Args:
            scan: In the odometry frame, its beams from one place.
            robot: (2,) position [m].
            memory: Before the scan is taken into it.
        """
        scans = self._scans.setdefault(name, deque())
        if scans and stamp - scans[-1][0] < OFTEN:
            return
        while scans and stamp - scans[0][0] > KEEP:
            scans.popleft()
        earlier = [pair for pair in scans if stamp - pair[0] >= BETWEEN]
        scans.append((stamp, scan))
        if not earlier:
            return
        then, before = earlier[-1]
        here = _unexplained(scan.hits, robot, memory)
        if not len(here):
            return
        here = here[_was_free(here, before)]
        if not len(here):
            return
        there = _away_from(scan.hits, _unexplained(before.hits, robot, memory))
        if not len(there):
            return
        way = here - there[squared_distances(here, there).argmin(axis=1)]
        velocity = way / (stamp - then)
        walks = squared_lengths(velocity) <= FASTEST * FASTEST
        guesses = self._guesses.setdefault(name, deque())
        while guesses and stamp - guesses[0][0] > PERSISTS:
            guesses.popleft()
        confirmed = _go_on(stamp, here, velocity, guesses) & walks
        if walks.any():
            guesses.append((stamp, here[walks]))
        if confirmed.any():
            self._found[name] = stamp, here[confirmed], velocity[confirmed]

    def now(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 2) [m], moved on to now, and velocities (n, 2) [m/s] of what moves."""
        points: list[np.ndarray] = [np.empty((0, 2))]
        velocities: list[np.ndarray] = [np.empty((0, 2))]
        for stamp, places, velocity in self._found.values():
            if now - stamp <= PERSISTS:
                points.append(places + (now - stamp) * velocity)
                velocities.append(velocity)
        return np.concatenate(points), np.concatenate(velocities)


def _go_on(
    stamp: float, places: np.ndarray, velocities: np.ndarray, guesses: deque[tuple[float, np.ndarray]]
) -> np.ndarray:
    """Which movers have come from an earlier guess the way their velocity says. A leg that flickers stays in place."""
    confirmed = np.zeros(len(places), bool)
    for then, earlier in guesses:
        passed = stamp - then
        if passed < GOES_ON:
            continue
        way = places[:, None] - earlier
        expected = (velocities * passed)[:, None]
        length = (expected**2).sum(axis=2)
        advanced = (way * expected).sum(axis=2) >= 0.5 * length
        near = ((way - expected) ** 2).sum(axis=2) <= OFF_COURSE * OFF_COURSE
        confirmed |= (advanced & near).any(axis=1)
    return confirmed


def _unexplained(hits: np.ndarray, robot: np.ndarray, memory: ObstacleMemory) -> np.ndarray:
    """Returns near the robot that no well known obstacle explains."""
    hits = hits[squared_lengths(hits - robot) < REACH * REACH]
    return _away_from(memory.points[memory.sightings >= WELL_KNOWN], hits)


def _away_from(known: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Those points that have none of `known` beside them."""
    if not len(points) or not len(known):
        return points
    return points[squared_distances(points, known).min(axis=1) > KNOWN * KNOWN]


def _was_free(points: np.ndarray, scan: Scan) -> np.ndarray:
    """Which points lie between two beams that both read farther."""
    if not len(scan.free):
        return np.zeros(len(points), bool)
    offset = points - scan.origins[0]
    distance = np.sqrt(squared_lengths(offset))
    along = offset @ scan.directions.T
    aside = offset[:, 1:] * scan.directions[:, 0] - offset[:, :1] * scan.directions[:, 1]
    ahead = along > 0.0
    free = np.ones(len(points), bool)
    for side in (np.where(ahead & (aside >= 0.0), aside, math.inf), np.where(ahead & (aside < 0.0), -aside, math.inf)):
        beam = side.argmin(axis=1)
        within = side[np.arange(len(points)), beam] < BESIDE * distance
        free &= within & (scan.free[beam] > distance + FARTHER)
    return free
