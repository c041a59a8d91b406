"""Free zones: the circle of free floor near the robot, from what the lasers saw lately.

Floor that no laser has seen is not free, so a robot that has not turned finds little room beside and behind it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from pepper_sim.navigation.scans import LASER_PLACES, Scan, transform
from telepresence.geometry import Pose

OWN_RADIUS = 0.3
"""The floor under the robot is free [m]."""
_CELL = 0.05


@dataclass(frozen=True)
class FreeZone:
    """A circle of free floor.

    Args:
        fulfilled: Whether it is as large and as near as was asked for; else it is the largest one within reach.
        radius: [m]
        x, y: Its centre by odometry [m].
    """

    fulfilled: bool
    radius: float
    x: float
    y: float


def find_free_zone(scans: Sequence[Scan], here: Pose, radius: float, displacement: float) -> FreeZone:
    """Return the nearest circle of `radius` [m] that is free, with its centre within `displacement` [m] of the robot.

    Args:
        scans: What was seen.
        here: The robot's present pose by odometry.
    """
    side = displacement + radius + 0.5
    cells = 2 * math.ceil(side / _CELL) + 1
    middle = cells // 2
    seen = np.zeros((cells, cells), np.uint8)
    blocked = np.zeros((cells, cells), bool)
    for scan in scans:
        ends = _cells(transform(scan.odometry, scan.points), here, middle)
        starts = _cells(transform(scan.odometry, scan.origins), here, middle)
        for part in np.split(np.arange(len(ends)), len(LASER_PLACES)):
            outline = np.concatenate([starts[part[:1]], ends[part]])
            cv2.fillPoly(seen, [outline.astype(np.int32)], 1)
        hits = ends[scan.hit]
        hits = hits[((hits >= 0) & (hits < cells)).all(axis=1)]
        blocked[hits[:, 1], hits[:, 0]] = True
    cv2.circle(seen, (middle, middle), round(OWN_RADIUS / _CELL), 1, -1)
    room = cv2.distanceTransform(((seen > 0) & ~blocked).astype(np.uint8), cv2.DIST_L2, 5) * _CELL
    rows, columns = np.mgrid[:cells, :cells]
    away = np.hypot(rows - middle, columns - middle) * _CELL
    room[away > displacement + 1e-9] = 0.0
    if (room >= radius).any():
        best = np.where(room >= radius, away, np.inf).argmin()
        fulfilled, found = True, radius
    else:
        best = (room - 1e-3 * away).argmax()
        fulfilled, found = False, float(room.flat[best])
    row, column = divmod(int(best), cells)
    return FreeZone(fulfilled, found, here.x + (column - middle) * _CELL, here.y + (row - middle) * _CELL)


def _cells(points: np.ndarray, here: Pose, middle: int) -> np.ndarray:
    """Return columns and rows of points given by odometry, shape (n, 2)."""
    return np.rint((points - here[:2]) / _CELL).astype(np.int64) + middle
