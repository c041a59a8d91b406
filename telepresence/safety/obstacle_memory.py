"""Obstacles once seen, kept in the odometry frame: what lies between two beams now was on one a moment ago.

A point is averaged with later sightings, forgotten after a while, and taken back only after several beams have gone
through its place and read clearly farther: a thin leg is missed more often than it is hit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .plane import left_of, squared_distances, squared_lengths
from .scan import Scan

FIRST_LIFETIME = 3.0
"""How long a single sighting is kept; each further one doubles it, up to the lifetime. Things that stand are seen
again; noise, and what somebody's legs leave behind, isn't. Longer than a to and fro of the careful scan [s]."""
DOUBLINGS = 20.0
"""More sightings than this don't count: no lifetime is that long, and a number doubled for ever ends."""
BELIEVED = 3
"""What was seen no more often than this ages at a standstill too."""
CAPACITY = 128
REACH = 1.5
"""Sightings farther from the robot than this are not kept [m]."""
SAME_ALONG = 0.05
"""Sightings this near to the first of an obstacle along the beam, and `Scan.same_across` across it, are the same one
[m]. Near to the first, not to the average: a beam that wanders over a surface would drag that along, away from the
corner it stood for."""
NEWEST = 0.3
"""Least weight of a new sighting in the average."""
THROUGH = 0.005
"""A beam this near to a point goes through it [m] ..."""
THROUGH_FELT = 0.02
"""... and this near to one that was felt: the bumper's place is a guess [m]."""
FARTHER = 0.06
"""... and contradicts it when it reads this much beyond it [m]."""
MISSES = 4
"""Contradictions until a point is taken back; a new sighting starts the count again."""


class Moment(NamedTuple):
    """A point in time as memory counts it.

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
    """At most `CAPACITY` points near the robot.

    Args:
        lifetime: After the last of many sightings [s].
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
        """(n,) how often each was seen."""
        return self._table[:, _SIGHTINGS]

    def integrate(self, scan: Scan, robot: np.ndarray, moment: Moment) -> None:
        """Take in one scan.

        Args:
            scan: In the odometry frame.
            robot: (2,) position now [m].
        """
        seen = self._merge(scan, robot, moment)
        self._contradict(scan, seen)

    def add(self, points: np.ndarray, moment: Moment, lifetime: float) -> None:
        """Put in obstacles that were felt, not seen. Shape (n, 2), odometry frame [m]."""
        rows = _rows(points, moment, lifetime, THROUGH_FELT)
        rows[:, _YOUNG_UNTIL] = np.inf
        self._table = np.concatenate([self._table, rows])

    def drop(self, which: np.ndarray) -> None:
        """Forget the points of a mask (n,)."""
        if which.any():
            self._table = self._table[~which]

    def limit(self, robot: np.ndarray, moment: Moment) -> None:
        """Forget what is old, far or contradicted, and the farthest if there are too many. Call it every tick."""
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
        """Average returns into known points, append the others. Returns which of the known points were seen."""
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
        """Known points are seen again, at `hits`."""
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
        """Count beams that go through points that this scan has not seen."""
        doubted = np.flatnonzero(~seen)
        if not len(doubted) or not len(scan.free):
            return
        points, ahead = self._table[doubted, _PLACE], scan.directions
        aside = left_of(ahead)
        across = np.abs(points @ aside.T - np.einsum("ij,ij->i", scan.origins, aside))
        # Few beams come near to any point: the rest is worked out for those only.
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
