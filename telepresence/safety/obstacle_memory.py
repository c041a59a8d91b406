"""Obstacles seen before, in the odometry frame: what lies between two beams now was hit by one a moment ago.

A point is averaged with later sightings, forgotten after a while, and removed only after several beams have passed
through it and read clearly farther: a thin leg is missed more often than it is hit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .plane import left_of, squared_distances, squared_lengths
from .scan import Scan

FIRST_LIFETIME = 3.0
"""How long a single sighting is kept; each further one doubles it, up to the lifetime. Standing things are seen again;
noise, and what a passing person leaves behind, is not. The careful scan counts on it [s]."""
DOUBLINGS = 20.0
"""Further sightings do not count: no lifetime is that long, and the doubling would overflow."""
BELIEVED = 3
"""Points seen no more often than this age while the robot stands, too."""
CAPACITY = 128
"""Most points that are kept; the nearest ones stay."""
REACH = 1.5
"""Sightings farther from the robot than this are not kept [m]."""
SAME_ALONG = 0.05
"""Sightings within this distance along the beam, and `Scan.same_across` across it, of an obstacle's first sighting are
the same obstacle [m]. The first, not the average: a beam that moves over a surface would drag the average along, away
from the corner that it stood for."""
NEWEST = 0.3
"""Least weight of a new sighting in the average."""
THROUGH = 0.005
"""A beam this near to a point goes through it [m] ..."""
THROUGH_FELT = 0.02
"""... and this near to one that a bumper reported, whose position is a guess [m]."""
FARTHER = 0.06
"""... and contradicts it when it reads this much beyond it [m]."""
MISSES = 4
"""Contradictions until a point is removed; a new sighting resets the count."""


class Moment(NamedTuple):
    """A point in time, on the three scales that memory uses.

    Args:
        now: [s].
        age: A clock that runs slower while the robot stands, because then nothing drifts [s].
        driven: Path length so far [m].
    """

    now: float
    age: float
    driven: float


_X, _Y, _FIRST_X, _FIRST_Y, _DRIVEN, _UNTIL, _YOUNG_UNTIL, _SIGHTINGS, _MISSES, _WIDTH = range(10)
_PLACE, _FIRST = slice(_X, _Y + 1), slice(_FIRST_X, _FIRST_Y + 1)


class ObstacleMemory:
    """Remembers at most `CAPACITY` points near the robot.

    Args:
        lifetime: How long a point is kept after the last of many sightings [s].
    """

    def __init__(self, lifetime: float) -> None:
        self._lifetime = lifetime
        self.clear()

    def clear(self) -> None:
        self._table: np.ndarray = np.empty((0, 10))

    def __len__(self) -> int:
        return len(self._table)

    @property
    def points(self) -> np.ndarray:
        """(n, 2) odometry frame [m]."""
        return self._table[:, _PLACE]

    @property
    def driven(self) -> np.ndarray:
        """(n,) path length at the last sighting [m]."""
        return self._table[:, _DRIVEN]

    @property
    def sightings(self) -> np.ndarray:
        """(n,) how often each has been seen."""
        return self._table[:, _SIGHTINGS]

    def integrate(self, scan: Scan, robot: np.ndarray, moment: Moment) -> None:
        """Integrate one scan.

        Args:
            scan: In the odometry frame.
            robot: (2,) position now [m].
        """
        seen = self._merge(scan, robot, moment)
        self._contradict(scan, seen)

    def add(self, points: np.ndarray, moment: Moment, lifetime: float) -> None:
        """Add obstacles that a bumper has hit. Shape (n, 2), odometry frame [m]."""
        rows = _rows(points, moment, lifetime, THROUGH_FELT)
        rows[:, _YOUNG_UNTIL] = np.inf
        self._table = np.concatenate([self._table, rows])

    def move(self, angle: float, before: tuple[float, float], after: tuple[float, float]) -> None:
        """Turn all points by `angle` [rad] around `before` [m], which then lies at `after`."""
        c, s = math.cos(angle), math.sin(angle)
        for columns in (_PLACE, _FIRST):
            self._table[:, columns] = (self._table[:, columns] - before) @ np.array([[c, s], [-s, c]]) + after

    def drop(self, which: np.ndarray) -> None:
        """Forget the points that a mask (n,) selects."""
        if which.any():
            self._table = self._table[~which]

    def limit(self, robot: np.ndarray, moment: Moment) -> None:
        """Forget points that are old, far or contradicted, and the farthest of too many. Call it every tick."""
        table = self._table
        if not len(table):
            return
        away = squared_lengths(table[:, _PLACE] - robot)
        young = (table[:, _UNTIL] > moment.age) & (table[:, _YOUNG_UNTIL] > moment.now)
        keep = young & (table[:, _MISSES] < MISSES) & (away < REACH * REACH)
        count = np.count_nonzero(keep)
        if count > CAPACITY:
            self._table = table[np.argpartition(np.where(keep, away, np.inf), CAPACITY)[:CAPACITY]]
        elif count < len(table):
            self._table = table[keep]

    def _merge(self, scan: Scan, robot: np.ndarray, moment: Moment) -> np.ndarray:
        """Average hits into known points and append the others. Return which of the known points were seen."""
        table = self._table
        seen = np.zeros(len(table), bool)
        hits, beams, width = scan.hits, scan.directions[scan.hit], scan.same_across[scan.hit]
        near = squared_lengths(hits - robot) < REACH * REACH
        if not near.all():
            hits, beams, width = hits[near], beams[near], width[near]
        if not len(hits):
            return seen
        new = np.ones(len(hits), bool)
        if len(table):
            nearest = squared_distances(hits, table[:, _FIRST]).argmin(axis=1)
            offset = hits - table[nearest, _FIRST]
            along = offset[:, 0] * beams[:, 0] + offset[:, 1] * beams[:, 1]
            across = offset[:, 1] * beams[:, 0] - offset[:, 0] * beams[:, 1]
            known = (along / SAME_ALONG) ** 2 + (across / width) ** 2 < 1.0
            self._see(nearest[known], hits[known], moment)
            seen[nearest[known]] = True
            new = ~known
        if new.any():
            self._table = np.concatenate([table, _rows(hits[new], moment, self._lifetime, THROUGH)])
        return seen

    def _see(self, which: np.ndarray, hits: np.ndarray, moment: Moment) -> None:
        """Update known points that were seen again, at `hits`."""
        rows = self._table[which]
        rows[:, _SIGHTINGS] += 1.0
        sightings = rows[:, _SIGHTINGS]
        weight = np.maximum(1.0 / sightings, NEWEST)
        rows[:, _PLACE] += weight[:, None] * (hits - rows[:, _PLACE])
        kept = np.minimum(FIRST_LIFETIME * np.exp2(np.minimum(sightings, DOUBLINGS) - 1.0), self._lifetime)
        rows[:, _UNTIL] = np.maximum(rows[:, _UNTIL], moment.age + kept)
        rows[:, _YOUNG_UNTIL] = np.where(sightings <= BELIEVED, moment.now + kept, np.inf)
        rows[:, _DRIVEN] = moment.driven
        rows[:, _MISSES] = 0.0
        self._table[which] = rows

    def _contradict(self, scan: Scan, seen: np.ndarray) -> None:
        """Count the beams that pass through points that this scan has not seen."""
        doubted = np.flatnonzero(~seen)
        if not len(doubted) or not len(scan.free):
            return
        points, ahead = self._table[doubted, _PLACE], scan.directions
        aside = left_of(ahead)
        across = np.abs(points @ aside.T - np.einsum("ij,ij->i", scan.origins, aside))
        # Few beams pass near any point, so the rest is computed for those only.
        point, beam = np.nonzero(across < self._table[doubted, _WIDTH, None])
        offset = points[point] - scan.origins[beam]
        along = np.einsum("ij,ij->i", offset, ahead[beam])
        through = (along > scan.min_range[beam]) & (along + FARTHER < scan.free[beam])
        missed = np.zeros(len(doubted), bool)
        missed[point[through]] = True
        self._table[doubted[missed], _MISSES] += 1.0


def _rows(points: np.ndarray, moment: Moment, lifetime: float, width: float) -> np.ndarray:
    rows = np.empty((len(points), 10))
    rows[:, _PLACE] = rows[:, _FIRST] = points
    rows[:, _DRIVEN:] = (
        moment.driven, moment.age + lifetime, moment.now + FIRST_LIFETIME, 1.0, 0.0, width,
    )  # fmt: skip
    return rows
