"""Obstacles once seen, kept in the odometry frame: what lies between two beams now was on one a moment ago.

A point is averaged with later sightings, forgotten after a while, and taken back only after several beams have gone
through its place and read clearly farther: a thin leg is missed more often than it is hit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .plane import squared_lengths
from .scan import Scan

FIRST_LIFETIME = 3.0
"""How long a single sighting is kept; each further one doubles it, up to the lifetime. Things that stand are seen again;
noise, and what somebody's legs leave behind, isn't. Longer than a to and fro of the careful scan [s]."""
CAPACITY = 128
REACH = 1.5
"""Sightings farther from the robot than this are not kept [m]."""
SAME_ALONG, SAME_ACROSS = 0.05, 0.02
"""Sightings this near to each other, along and across the beam, are one obstacle [m]. They are averaged along the beam
only: across, a beam that wanders over a surface would drag the point along and leave the corner it stood for."""
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


class ObstacleMemory:
    """At most `CAPACITY` points near the robot.

    Args:
        lifetime: After the last of many sightings [s].
    Attributes:
        points: (n, 2) odometry frame [m].
        driven: (n,) path length at the last sighting [m].
        sightings: (n,) how often each was seen.
        doubtful: (n,) those seen once, from so far away that it may have been noise.
    """

    def __init__(self, lifetime: float) -> None:
        self._lifetime = lifetime
        self.clear()

    def clear(self) -> None:
        self.points = np.empty((0, 2))
        self.driven = np.empty(0)
        self.doubtful = np.empty(0, bool)
        self._single_until = np.empty(0)
        self._until = np.empty(0)
        self.sightings = np.empty(0)
        self._misses = np.empty(0)
        self._width = np.empty(0)

    def __len__(self) -> int:
        return len(self.points)

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
        self._append(points, moment, lifetime, THROUGH_FELT)
        self._single_until[-len(points) :] = np.inf

    def drop(self, which: np.ndarray) -> None:
        """Forget the points of a mask (n,)."""
        self._keep(~which)

    def limit(self, robot: np.ndarray, moment: Moment) -> None:
        """Forget what is old, far or contradicted, and the farthest if there are too many. Call it every tick."""
        if not len(self.points):
            return
        away = squared_lengths(self.points - robot)
        young = (self._until > moment.age) & (self._single_until > moment.now)
        keep = young & (self._misses < MISSES) & (away < REACH * REACH)
        if np.count_nonzero(keep) > CAPACITY:
            nearest = np.argpartition(np.where(keep, away, np.inf), CAPACITY)[:CAPACITY]
            keep = np.zeros(len(keep), bool)
            keep[nearest] = True
        self._keep(keep)

    def _merge(self, scan: Scan, robot: np.ndarray, moment: Moment) -> np.ndarray:
        """Average returns into known points, append the others. Returns which of the known points were seen."""
        seen = np.zeros(len(self.points), bool)
        hit = scan.ranges < np.inf
        hits, beams, far = scan.hits, scan.directions[hit], scan.ranges[hit] > scan.sure_range
        near = squared_lengths(hits - robot) < REACH * REACH
        hits, beams, far = hits[near], beams[near], far[near]
        if not len(hits):
            return seen
        new = np.ones(len(hits), bool)
        if len(self.points):
            along, across = _along_and_across(self.points, hits, beams)
            fit = (along / SAME_ALONG) ** 2 + (across / SAME_ACROSS) ** 2
            nearest = fit.argmin(axis=0)
            known = fit[nearest, np.arange(len(hits))] < 1.0
            which = nearest[known]
            self.sightings[which] += 1.0
            weight = np.maximum(1.0 / self.sightings[which], NEWEST)
            step = weight * along[which, np.flatnonzero(known)]
            self.points[which] -= step[:, None] * beams[known]
            kept = np.minimum(FIRST_LIFETIME * 2.0 ** (self.sightings[which] - 1.0), self._lifetime)
            self._until[which] = np.maximum(self._until[which], moment.age + kept)
            self._single_until[which] = np.inf
            self.doubtful[which] = False
            self.driven[which] = moment.driven
            self._misses[which] = 0.0
            seen[which] = True
            new = ~known
        if new.any():
            self._append(hits[new], moment, self._lifetime, THROUGH)
            self.doubtful[len(self.doubtful) - np.count_nonzero(new) :] = far[new]
        return seen

    def _append(self, points: np.ndarray, moment: Moment, lifetime: float, width: float) -> None:
        count = len(points)
        self.points = np.concatenate([self.points, points])
        self.driven = np.concatenate([self.driven, np.full(count, moment.driven)])
        self.doubtful = np.concatenate([self.doubtful, np.zeros(count, bool)])
        self._until = np.concatenate([self._until, np.full(count, moment.age + lifetime)])
        self._single_until = np.concatenate([self._single_until, np.full(count, moment.now + FIRST_LIFETIME)])
        self.sightings = np.concatenate([self.sightings, np.ones(count)])
        self._misses = np.concatenate([self._misses, np.zeros(count)])
        self._width = np.concatenate([self._width, np.full(count, width)])

    def _contradict(self, scan: Scan, seen: np.ndarray) -> None:
        """Count beams that go through points that this scan has not seen."""
        doubted = np.flatnonzero(~seen)
        if not len(doubted) or not len(scan.free):
            return
        along, across = _along_and_across(self.points[doubted], scan.origins, scan.directions)
        through = (
            (np.abs(across) < self._width[doubted, None]) & (along > scan.min_range) & (along + FARTHER < scan.free)
        )
        self._misses[doubted] += through.any(axis=1)

    def _keep(self, keep: np.ndarray) -> None:
        if keep.all():
            return
        self.points = self.points[keep]
        self.driven = self.driven[keep]
        self.doubtful = self.doubtful[keep]
        self._single_until = self._single_until[keep]
        self._until = self._until[keep]
        self.sightings = self.sightings[keep]
        self._misses = self._misses[keep]
        self._width = self._width[keep]


def _along_and_across(points: np.ndarray, origins: np.ndarray, beams: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Offset of points (n, 2) from origins (m, 2) along and to the left of the unit vectors `beams`, (n, m) each [m]."""
    aside = np.stack([-beams[:, 1], beams[:, 0]], axis=1)
    along = points @ beams.T - np.einsum("ij,ij->i", origins, beams)
    return along, points @ aside.T - np.einsum("ij,ij->i", origins, aside)
