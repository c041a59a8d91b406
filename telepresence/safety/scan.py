"""One measurement of one source: checked, and transformed into the odometry frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .robot_profile import RangeSource


@dataclass(frozen=True)
class Scan:
    """Beams of one measurement in some frame; unknown beams are left out.

    Args:
        origins, directions: (n, 2) [m] and unit vectors.
        ranges: (n,) reading where something was hit, infinity elsewhere [m].
        free: (n,) how far each beam is known to pass [m].
        known: (beams,) which beams of the source have a reading.
        min_range: (n,) nearer than this the beams see nothing [m].
        same_across: (n,) returns no farther apart than this across the beam may be of the same thing [m].
    """

    origins: np.ndarray
    directions: np.ndarray
    ranges: np.ndarray
    free: np.ndarray
    known: np.ndarray
    min_range: np.ndarray
    same_across: np.ndarray

    @cached_property
    def hit(self) -> np.ndarray:
        """(n,) which beams hit something."""
        return self.ranges < math.inf

    @cached_property
    def hits(self) -> np.ndarray:
        """Positions of the returns, shape (m, 2) [m]."""
        return self.origins[self.hit] + self.ranges[self.hit, None] * self.directions[self.hit]

    def seen_from(self, x: float, y: float, theta: float) -> Scan:
        """Return the same beams in the frame in which the present one has this pose."""
        c, s = math.cos(theta), math.sin(theta)
        rotation = np.array([[c, s], [-s, c]])
        origins, directions = self.origins @ rotation + (x, y), self.directions @ rotation
        return replace(self, origins=origins, directions=directions)


def together(scans: Sequence[Scan]) -> Scan:
    """Join several scans of the same frame into one."""
    if len(scans) == 1:
        return scans[0]
    names = ("origins", "directions", "ranges", "free", "known", "min_range", "same_across")
    return Scan(*(np.concatenate([getattr(scan, name) for scan in scans]) for name in names))


def scan_of_ranges(source: RangeSource, ranges: np.ndarray) -> Scan | None:
    """Return a scan in base_link from readings in the order of the source's beams; None if they are invalid.

    Args:
        ranges: Shape (n,) [m]; from max_range on nothing is there, negative or below min_range is unknown.
    """
    ranges = np.asarray(ranges, float)
    if ranges.shape != (source.beams,) or not np.isfinite(ranges).all():
        return None
    return _scan(source, source.origins, source.directions, ranges)


def scan_of_points(source: RangeSource, points: np.ndarray) -> Scan | None:
    """Do as `scan_of_ranges`, for a driver that gives the position of each return in base_link, shape (n, 2) [m].

    The direction is taken from the point. A beam without a return is a point at or beyond max_range.
    """
    points = np.asarray(points, float)
    if points.shape != (source.beams, 2) or not np.isfinite(points).all():
        return None
    beams = points - source.origins
    ranges = np.hypot(beams[:, 0], beams[:, 1])
    directions = np.where((ranges > 1e-6)[:, None], beams / np.maximum(ranges, 1e-6)[:, None], source.directions)
    return _scan(source, source.origins, directions, ranges)


def _scan(source: RangeSource, origins: np.ndarray, directions: np.ndarray, ranges: np.ndarray) -> Scan:
    known = ranges >= (0.0 if source.cone else source.min_range)
    if not known.all():
        origins, directions, ranges = origins[known], directions[known], ranges[known]
    hit = ranges < source.max_range
    free = np.where(hit, ranges, source.clear_range)
    ranges = np.where(hit, ranges, math.inf)
    count = len(ranges)
    return Scan(
        origins, directions, ranges, free, known, np.full(count, source.min_range), np.full(count, source.same_across)
    )
