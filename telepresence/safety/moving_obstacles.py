"""Moving obstacles, mostly people: what has moved between two scans of a laser, and how fast.

A return where the floor was free a moment ago, and an earlier one near by that is gone, are one thing that has walked
from there to here. Obstacles that memory knows well are left out: thin legs of furniture appear and vanish between the
beams.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from .obstacle_memory import ObstacleMemory
from .plane import squared_distances, squared_lengths
from .scan import Scan

REACH = 2.5
"""Movers farther from the robot than this are ignored [m]."""
OFTEN = 0.09
"""Scans that follow sooner than this are left out: people do not get far in it [s]."""
BETWEEN = 0.40
"""Scans are compared over at least this time [s] ..."""
KEEP = 0.8
"""... and at most this [s]."""
GOES_ON = 0.1
"""Two findings at least this far apart must agree ..."""
PERSISTS = 0.3
"""... and at most this; a mover that is not recognised again is kept for as long [s]."""
OFF_COURSE = 0.20
"""Largest distance between an obstacle and where its velocity would have brought it [m]."""
FARTHER = 0.12
"""A place was free if the beams to both sides of it read this much farther [m]."""
BESIDE = math.sin(0.2)
"""Sine of the widest angle between a place and the beams to both sides of it."""
KNOWN = 0.08
"""An obstacle within this distance explains a return [m]."""
WELL_KNOWN = 6
"""Sightings that make an obstacle well known."""
FASTEST_MOVER = 2.0
"""People do not walk faster [m/s]; ISO 13855 assumes 1.6."""


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
            memory: Before this scan is integrated.
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
        walks = squared_lengths(velocity) <= FASTEST_MOVER * FASTEST_MOVER
        guesses = self._guesses.setdefault(name, deque())
        while guesses and stamp - guesses[0][0] > PERSISTS:
            guesses.popleft()
        confirmed = _go_on(stamp, here, velocity, guesses) & walks
        if walks.any():
            guesses.append((stamp, here[walks]))
        if confirmed.any():
            self._found[name] = stamp, here[confirmed], velocity[confirmed]

    def now(self, now: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 2) [m], extrapolated to now, and velocities (n, 2) [m/s] of what moves."""
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
    """Return which movers have moved since an earlier guess as their velocity predicts; a flickering leg has not."""
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
    """Return those hits near the robot that no well known obstacle explains."""
    hits = hits[squared_lengths(hits - robot) < REACH * REACH]
    return _away_from(memory.points[memory.sightings >= WELL_KNOWN], hits)


def _away_from(known: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return those points that have none of `known` near them."""
    if not len(points) or not len(known):
        return points
    return points[squared_distances(points, known).min(axis=1) > KNOWN * KNOWN]


def _was_free(points: np.ndarray, scan: Scan) -> np.ndarray:
    """Return which points lie between two beams that both read farther."""
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
