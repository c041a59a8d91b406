"""What the values of Pepper's six laser lines mean: for the safety gate and for the topics alike. No ROS.

Wire (NAOqi 2.8 documentation, laser_pep): ALMemory holds for every segment of a line the keys
`Device/SubDeviceList/Platform/LaserSensor/<line>/SegNN/{X,Y}/Sensor/Value` [m], renewed every 160 ms. They are the
point where the laser plane hits something, projected onto the ground, in a frame on the floor under the camera that
saw it: x ahead of that camera, y to its left. Seg01 is the leftmost.

All points are in such floor frames; the shovel and the two vertical lines are seen by the front camera too, so their
frame is the front one's, not that of their projectors.

What a segment holds when nothing was hit is not documented. Taken as nothing hit is what lies at the end of the
range (3 m in practice: softbankrobotics-research/qibullet, laser.py), and as a filler what no ray of the camera can
have hit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from naoqi_driver.replies import as_number
from naoqi_driver.robot_facts import FRONT, LEFT, LINE_WIDTH, MAX_RANGE, MIN_RANGE, RIGHT, SEGMENTS, FloorFrame

_DEVICE = "Device/SubDeviceList/Platform/LaserSensor"
IN_FAN = 0.5 * LINE_WIDTH + math.radians(4.0)
"""A point farther than this from its camera's axis [rad] is a filler, as (-1, -1): the fan has 30 degrees to either
side."""
NOTHING_FROM, NOTHING_AT = MAX_RANGE - 0.05, MAX_RANGE + 0.5
"""A point farther than the first [m] is one where nothing was hit; it is put at the second, beyond the gate's range.
A robot that fills such segments with points at exactly 3 m would seem to see a circle that moves along with it."""


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
"""The three horizontal lines, `srd_…`, are 0.034 m above the floor; the gate takes those."""


def keys(line: Line) -> list[str]:
    """Return a line's keys in ALMemory: X and Y of every segment, leftmost first."""
    return [
        f"{_DEVICE}/{line.key}/Seg{segment:02d}/{axis}/Sensor/Value"
        for segment in range(1, line.segments + 1)
        for axis in "XY"
    ]


def clean(values: Sequence[object]) -> np.ndarray:
    """Return a line's points, (segments, 2) [m] in its floor frame, leftmost first.

    A point at `NOTHING_AT` is one where nothing was hit. A point in the camera, (0, 0), says nothing: the robot lacks
    the key, or has filled it. NaN is what nobody can have measured; the gate refuses the whole line then, and the robot
    stands.

    Args:
        values: What ALMemory holds for the line's `keys`.
    """
    given = np.array([isinstance(value, int | float) for value in values]).reshape(-1, 2).all(axis=1)
    points = np.array([as_number(value) for value in values], float).reshape(-1, 2)
    filler = np.abs(np.arctan2(points[:, 1], points[:, 0])) > IN_FAN
    points[~given | filler] = 0.0
    distance = np.hypot(points[:, 0], points[:, 1])
    far = distance > NOTHING_FROM
    points[far] *= (NOTHING_AT / distance[far])[:, None]
    return points


def hits(points: np.ndarray) -> np.ndarray:
    """Return which of a line's clean points (n, 2) are of something that was hit, shape (n,)."""
    distance = np.hypot(points[:, 0], points[:, 1])
    return (distance >= MIN_RANGE) & (distance < MAX_RANGE)


def to_base(points: np.ndarray, frame: FloorFrame) -> np.ndarray:
    """Return points of a floor frame, (n, 2) [m], in base_footprint."""
    c, s = math.cos(frame.theta), math.sin(frame.theta)
    return points @ np.array(((c, s), (-s, c))) + (frame.x, frame.y)
