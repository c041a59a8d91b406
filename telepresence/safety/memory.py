"""Obstacles once seen, kept in the odometry frame: what lies between two beams now was on one a moment ago.

A point is averaged with later sightings, forgotten after a while, and taken back only after several beams have gone
through its place and read clearly farther: a thin leg is missed more often than it is hit.
"""

from __future__ import annotations

import numpy as np

from .scan import Scan

FIRST_LIFETIME = 3.0
"""How long a single sighting is kept; each further one doubles it, up to the lifetime. Things that stand are seen again;
what somebody's legs leave behind isn't. Longer than a to and fro of the careful scan [s]."""
CAPACITY = 128
REACH = 1.5
"""Sightings farther from the robot than this are not kept [m]."""
SAME = 0.03
"""Sightings nearer to each other than this are one obstacle [m]."""
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


class ObstacleMemory:
    """At most `CAPACITY` points near the robot. Times are on the owner's clock, which may run slower at a standstill.

    Args:
        lifetime: After the last of many sightings [s].
    Attributes:
        points: (n, 2) odometry frame [m].
        driven: (n,) path length at the last sighting [m].
        sightings: (n,) how often each was seen.
    """

    def __init__(self, lifetime: float) -> None:
        self._lifetime = lifetime
        self.clear()

    def clear(self) -> None:
        self.points = np.empty((0, 2))
        self.driven = np.empty(0)
        self._until = np.empty(0)
        self.sightings = np.empty(0)
        self._misses = np.empty(0)
        self._width = np.empty(0)

    def __len__(self) -> int:
        return len(self.points)

    def integrate(self, scan: Scan, robot: np.ndarray, clock: float, driven: float) -> None:
        """Take in one scan.

        Args:
            scan: In the odometry frame.
            robot: (2,) position now [m].
            clock: Now [s].
            driven: Path length so far [m]; stored with each sighting as `driven`.
        """
        hits = scan.hits
        hits = hits[((hits - robot) ** 2).sum(axis=1) < REACH * REACH]
        seen = self._merge(hits, clock, driven)
        self._contradict(scan, seen)

    def add(self, points: np.ndarray, clock: float, driven: float, lifetime: float) -> None:
        """Put in obstacles that were felt, not seen. Shape (n, 2), odometry frame [m]."""
        self._append(points, clock + lifetime, driven, THROUGH_FELT)

    def drop(self, which: np.ndarray) -> None:
        """Forget the points of a mask (n,)."""
        self._keep(~which)

    def limit(self, robot: np.ndarray, clock: float) -> None:
        """Forget what is old, far or contradicted, and the farthest if there are too many. Call it every tick."""
        if not len(self.points):
            return
        away = ((self.points - robot) ** 2).sum(axis=1)
        keep = (self._until > clock) & (self._misses < MISSES) & (away < REACH * REACH)
        if np.count_nonzero(keep) > CAPACITY:
            nearest = np.argpartition(np.where(keep, away, np.inf), CAPACITY)[:CAPACITY]
            keep = np.zeros(len(keep), bool)
            keep[nearest] = True
        self._keep(keep)

    def _merge(self, hits: np.ndarray, clock: float, driven: float) -> np.ndarray:
        """Average hits into known points, append the others. Returns which of the known points were seen."""
        seen = np.zeros(len(self.points), bool)
        if not len(hits):
            return seen
        new = np.ones(len(hits), bool)
        if len(self.points):
            squared = (hits**2).sum(axis=1)[:, None] + (self.points**2).sum(axis=1) - 2.0 * (hits @ self.points.T)
            nearest = squared.argmin(axis=1)
            known = squared[np.arange(len(hits)), nearest] < SAME * SAME
            which = nearest[known]
            self.sightings[which] += 1.0
            weight = np.maximum(1.0 / self.sightings[which], NEWEST)[:, None]
            self.points[which] += weight * (hits[known] - self.points[which])
            kept = np.minimum(FIRST_LIFETIME * 2.0 ** (self.sightings[which] - 1.0), self._lifetime)
            self._until[which] = np.maximum(self._until[which], clock + kept)
            self.driven[which] = driven
            self._misses[which] = 0.0
            seen[which] = True
            new = ~known
        if new.any():
            self._append(hits[new], clock + min(FIRST_LIFETIME, self._lifetime), driven, THROUGH)
        return seen

    def _append(self, points: np.ndarray, until: float, driven: float, width: float) -> None:
        count = len(points)
        self.points = np.concatenate([self.points, points])
        self.driven = np.concatenate([self.driven, np.full(count, driven)])
        self._until = np.concatenate([self._until, np.full(count, until)])
        self.sightings = np.concatenate([self.sightings, np.ones(count)])
        self._misses = np.concatenate([self._misses, np.zeros(count)])
        self._width = np.concatenate([self._width, np.full(count, width)])

    def _contradict(self, scan: Scan, seen: np.ndarray) -> None:
        """Count beams that go through points that this scan has not seen."""
        doubted = np.flatnonzero(~seen)
        if not len(doubted) or not len(scan.free):
            return
        points, ahead = self.points[doubted], scan.directions
        aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
        along = points @ ahead.T - (scan.origins * ahead).sum(axis=1)
        across = np.abs(points @ aside.T - (scan.origins * aside).sum(axis=1))
        through = (across < self._width[doubted, None]) & (along > scan.min_range) & (along + FARTHER < scan.free)
        self._misses[doubted] += through.any(axis=1)

    def _keep(self, keep: np.ndarray) -> None:
        if keep.all():
            return
        self.points = self.points[keep]
        self.driven = self.driven[keep]
        self._until = self._until[keep]
        self.sightings = self.sightings[keep]
        self._misses = self._misses[keep]
        self._width = self._width[keep]
