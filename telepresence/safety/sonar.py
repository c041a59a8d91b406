"""Wide cones: a reading says that something is at that distance, not where across the cone.

A doorway returns an echo from its posts although the way between them is free. So a reading is believed to come from
an obstacle that a narrower sensor has already placed at that distance inside the cone. Only a reading that nothing
known explains (glass, a table top) becomes an arc across the whole cone.
"""

from __future__ import annotations

import math

import numpy as np

from .profile import RangeSource
from .scan import Scan

EXPLAINS = 0.10
"""A known obstacle explains a reading that differs by no more than this [m]."""
SPACING = 0.05
"""Distance between points of an arc [m]."""


class ConeArcs:
    """The arcs of the newest unexplained readings, odometry frame."""

    def __init__(self) -> None:
        self._arcs: dict[str, np.ndarray] = {}

    def clear(self) -> None:
        self._arcs.clear()

    def forget(self, name: str) -> None:
        self._arcs.pop(name, None)

    def points(self) -> np.ndarray:
        """(n, 2) [m]."""
        return np.concatenate(list(self._arcs.values())) if self._arcs else np.empty((0, 2))

    def look(self, source: RangeSource, scan: Scan, known: np.ndarray) -> None:
        """Take in one reading.

        Args:
            scan: In the odometry frame.
            known: (n, 2) obstacles, odometry frame [m].
        """
        arcs = [np.empty((0, 2))]
        for index in np.flatnonzero(np.isfinite(scan.ranges)):
            origin, direction, distance = scan.origins[index], scan.directions[index], float(scan.ranges[index])
            near = distance <= source.min_range
            if not _explained(origin, direction, source.spread, 0.0 if near else distance, distance, known):
                arcs.append(_arc(origin, direction, source.spread, 0.5 * source.min_range if near else distance))
        self._arcs[source.name] = np.concatenate(arcs)


def _explained(
    origin: np.ndarray, direction: np.ndarray, spread: float, low: float, high: float, known: np.ndarray
) -> bool:
    if not len(known):
        return False
    offset = known - origin
    distance = np.hypot(offset[:, 0], offset[:, 1])
    inside = offset @ direction >= distance * math.cos(spread)
    return bool((inside & (distance > low - EXPLAINS) & (distance < high + EXPLAINS)).any())


def _arc(origin: np.ndarray, direction: np.ndarray, spread: float, distance: float) -> np.ndarray:
    count = 2 + int(2.0 * spread * distance / SPACING)
    angles = math.atan2(direction[1], direction[0]) + np.linspace(-spread, spread, count)
    return origin + distance * np.stack([np.cos(angles), np.sin(angles)], axis=1)
