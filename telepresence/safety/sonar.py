"""Wide cones: a reading says that something is at that distance, not where across the cone.

A doorway returns an echo from its posts although the way between them is free. So a reading is attributed to an
obstacle that a narrower sensor has already placed at that distance inside the cone. Only a reading that no known
obstacle explains (glass, a table top) counts, as an obstacle right across the cone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .plane import squared_lengths
from .robot_profile import RangeSource
from .scan import Scan

EXPLAINS = 0.06
"""A known obstacle explains a reading that differs by no more than this [m]."""


class Echo(NamedTuple):
    """An unexplained reading: its point on the cone's axis [m] and the axis as a unit vector, (2,) each, same frame."""

    place: np.ndarray
    axis: np.ndarray


class Echoes:
    """The newest unexplained reading of every cone, odometry frame."""

    def __init__(self) -> None:
        self._echoes: dict[str, Echo] = {}

    def clear(self) -> None:
        self._echoes.clear()

    def forget(self, name: str) -> None:
        self._echoes.pop(name, None)

    def __iter__(self) -> Iterator[Echo]:
        return iter(self._echoes.values())

    def observe(self, source: RangeSource, scan: Scan, known: np.ndarray) -> None:
        """Take one reading.

        Args:
            scan: In the odometry frame.
            known: (n, 2) obstacles, odometry frame [m].
        """
        self.forget(source.name)
        if not np.isfinite(scan.ranges).any():
            return
        origin, axis, distance = scan.origins[0], scan.directions[0], float(scan.ranges[0])
        near = distance <= source.min_range
        if not _explained(origin, axis, source.spread, 0.0 if near else distance, distance, known):
            self._echoes[source.name] = Echo(origin + (source.near_range if near else distance) * axis, axis)


def _explained(origin: np.ndarray, axis: np.ndarray, spread: float, low: float, high: float, known: np.ndarray) -> bool:
    if not len(known):
        return False
    offset = known - origin
    distance = np.sqrt(squared_lengths(offset))
    inside = offset @ axis >= distance * math.cos(spread)
    return bool((inside & (distance > low - EXPLAINS) & (distance < high + EXPLAINS)).any())
