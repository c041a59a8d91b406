"""Pepper's six laser lines.

Wire (NAOqi 2.8 documentation, laser_pep): ALMemory holds for every segment of a line the keys
`Device/SubDeviceList/Platform/LaserSensor/<line>/SegNN/{X,Y}/Sensor/Value` [m], renewed every 160 ms. They are the
point where the laser plane hits something, projected onto the ground, in a frame on the floor under the camera that
saw it: x ahead of that camera, y to its left. Seg01 is the leftmost. A point at 3 m or beyond means that nothing was
hit.

All points are in such floor frames; the shovel and the two vertical lines are seen by the front camera too, so their
frame is the front one's, not that of their projectors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from naoqi_driver.replies import as_number, sequence
from naoqi_driver.robot_facts import FRONT, LEFT, LINE_WIDTH, MAX_RANGE, MIN_RANGE, RIGHT, SEGMENTS, FloorFrame

SUBSCRIBER = "ROS"
_DEVICE = "Device/SubDeviceList/Platform/LaserSensor"


class Line(NamedTuple):
    """One laser line: its name in ALMemory, its segments, and the floor frame of its camera."""

    key: str
    segments: int
    frame: FloorFrame


LINES: Mapping[str, Line] = {
    "shovel": Line("Front/Shovel", 3, FRONT),
    "ground_left": Line("Front/Vertical/Left", 1, FRONT),
    "ground_right": Line("Front/Vertical/Right", 1, FRONT),
    "srd_front": Line("Front/Horizontal", SEGMENTS, FRONT),
    "srd_left": Line("Left/Horizontal", SEGMENTS, LEFT),
    "srd_right": Line("Right/Horizontal", SEGMENTS, RIGHT),
}
AROUND = ("srd_right", "srd_front", "srd_left")
"""The three horizontal lines, 0.034 m above the floor."""

KEYS: tuple[str, ...] = tuple(
    f"{_DEVICE}/{line.key}/Seg{segment:02d}/{axis}/Sensor/Value"
    for line in LINES.values()
    for segment in range(1, line.segments + 1)
    for axis in "XY"
)
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
    """The points of every line, (segments, 2) float [m] in its floor frame, leftmost first; NaN where the robot has no
    key.

    Args:
        values: What getListData answered for `KEYS`.
    Raises:
        UnexpectedReply: It is no list of that length.
    """
    values = sequence(values, "laser values", len(KEYS))
    numbers = np.array([as_number(value) for value in values], float)
    points, first = {}, 0
    for name, line in LINES.items():
        points[name] = numbers[first : first + 2 * line.segments].reshape(-1, 2)
        first += 2 * line.segments
    return points


def to_scan(points: np.ndarray) -> Scan:
    """One line as a scan of its own floor frame.

    The angles are those of the points. Ranges after REP 117: infinity where nothing was hit, NaN where nothing was
    measured (a point in the camera itself, or none).
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


def to_base(name: str, points: np.ndarray) -> np.ndarray:
    """Points of a line (n, 2) [m] in base_footprint."""
    frame = LINES[name].frame
    c, s = math.cos(frame.theta), math.sin(frame.theta)
    return points @ np.array(((c, s), (-s, c))) + (frame.x, frame.y)


AROUND_MAX_RANGE = MAX_RANGE + 0.1
"""Largest range of the merged scan [m]: the cameras stand up to 9 cm away from base_footprint."""
SCAN_INCREMENT = math.radians(4.0)
SCAN_EDGE = math.radians(132.0)
_BINS = round(2 * SCAN_EDGE / SCAN_INCREMENT) + 1


def merge(points: Mapping[str, np.ndarray]) -> Scan:
    """The three horizontal lines as one scan of base_footprint.

    Every point stands where it is seen from base_footprint; a direction that two points share gives the nearer one. The
    blind sectors (about 30 to 70 degrees on both sides) hold NaN, which is not the same as nothing there: infinity.
    """
    ranges = np.full(_BINS, math.nan)
    for name in AROUND:
        own = np.hypot(points[name][:, 0], points[name][:, 1])
        seen = own > 0.0
        at = to_base(name, points[name][seen])
        bins = np.round((np.arctan2(at[:, 1], at[:, 0]) + SCAN_EDGE) / SCAN_INCREMENT).astype(int)
        hit = np.where(own[seen] >= MAX_RANGE, math.inf, np.hypot(at[:, 0], at[:, 1]))
        for index, distance in zip(bins, hit, strict=True):
            if 0 <= index < _BINS:
                ranges[index] = np.fmin(ranges[index], distance)
    return Scan(-SCAN_EDGE, SCAN_INCREMENT, ranges)


def _to_ranges(distances: np.ndarray, measured: np.ndarray) -> np.ndarray:
    ranges = np.where(distances >= MAX_RANGE, math.inf, distances)
    ranges = np.where(distances < MIN_RANGE, -math.inf, ranges)
    return np.where(measured, ranges, math.nan)
