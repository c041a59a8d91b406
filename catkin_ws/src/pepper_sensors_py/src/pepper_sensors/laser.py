"""Pepper's six laser lines as scans.

What ALMemory's values mean is said once, for the safety gate too: `naoqi_driver.laser_points`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from naoqi_driver.laser_points import LINES, clean, hits, keys, to_base
from naoqi_driver.replies import as_number, sequence
from naoqi_driver.robot_facts import LINE_WIDTH, MAX_RANGE, MIN_RANGE

SUBSCRIBER = "ROS"
AROUND = ("srd_right", "srd_front", "srd_left")
"""The three horizontal lines, 0.034 m above the floor."""

KEYS = tuple(key for line in LINES.values() for key in keys(line))
"""Everything, for one call of getListData."""


class Scan(NamedTuple):
    """Ranges [m] counter-clockwise from `angle_min` [rad], one every `increment` [rad], as sensor_msgs/LaserScan has
    them."""

    angle_min: float
    increment: float
    ranges: np.ndarray

    @property
    def angle_max(self) -> float:
        return self.angle_min + self.increment * (len(self.ranges) - 1)


def read_points(values: Any) -> dict[str, np.ndarray]:
    """The points of every line, as `naoqi_driver.laser_points.clean` has them.

    Args:
        values: What getListData answered for `KEYS`.
    Raises:
        UnexpectedReply: It is no list of that length.
    """
    values = sequence(values, "laser values", len(KEYS))
    points, first = {}, 0
    for name, line in LINES.items():
        points[name] = clean(values[first : first + 2 * line.segments])
        first += 2 * line.segments
    return points


def count_missing(values: Sequence[object]) -> int:
    """How many of the values for `KEYS` are no number: the robot lacks the key, or its sensor is broken."""
    return sum(math.isnan(as_number(value)) for value in values)


def to_scan(points: np.ndarray) -> Scan:
    """One line as a scan of its own floor frame.

    The angles are those of the points. Ranges after REP 117: infinity where nothing was hit, minus infinity for what
    is too near to be measured, NaN where nothing was measured.
    """
    count = len(points)
    points = points[::-1]
    distances = np.hypot(points[:, 0], points[:, 1])
    measured = distances > 0.0
    increment = LINE_WIDTH / count
    angle_min = -increment * (count - 1) / 2
    if np.count_nonzero(measured) > 1:
        seen = np.flatnonzero(measured)
        bearings = np.arctan2(points[seen, 1], points[seen, 0])
        increment, angle_min = (float(part) for part in np.polyfit(seen, bearings, 1))
    elif np.count_nonzero(measured) == 1:
        only = int(np.flatnonzero(measured)[0])
        angle_min = math.atan2(points[only, 1], points[only, 0]) - increment * only
    return Scan(angle_min, increment, _to_ranges(distances, measured))


AROUND_MAX_RANGE = MAX_RANGE + 0.1
"""Largest range of the merged scan [m]: the cameras stand up to 9 cm away from base_footprint."""
SCAN_INCREMENT = math.radians(4.0)
SCAN_EDGE = math.radians(132.0)
_BINS = round(2 * SCAN_EDGE / SCAN_INCREMENT) + 1


def merge(points: Mapping[str, np.ndarray]) -> Scan:
    """The three horizontal lines as one scan of base_footprint.

    Every point stands where it is seen from base_footprint; a direction that two points share gives the nearer one. The
    blind sectors (about 30 to 70 degrees on both sides) hold NaN, which is not the same as nothing there: infinity. So
    does a direction in which a camera has measured nothing, or what is too near.
    """
    ranges = np.full(_BINS, math.nan)
    for name in AROUND:
        own = np.hypot(points[name][:, 0], points[name][:, 1])
        seen = own >= MIN_RANGE
        at = to_base(points[name][seen], LINES[name].frame)
        bins = np.round((np.arctan2(at[:, 1], at[:, 0]) + SCAN_EDGE) / SCAN_INCREMENT).astype(int)
        distances = np.where(hits(points[name][seen]), np.hypot(at[:, 0], at[:, 1]), math.inf)
        for index, distance in zip(bins, distances, strict=True):
            if 0 <= index < _BINS:
                ranges[index] = np.fmin(ranges[index], distance)
    return Scan(-SCAN_EDGE, SCAN_INCREMENT, ranges)


def _to_ranges(distances: np.ndarray, measured: np.ndarray) -> np.ndarray:
    ranges = np.where(distances >= MAX_RANGE, math.inf, distances)
    ranges = np.where(distances < MIN_RANGE, -math.inf, ranges)
    return np.where(measured, ranges, math.nan)
