"""The way to a place on the floor, as it lies in the picture: the band that the robot's body sweeps, and the ring in
which it stops. No ROS, no Qt."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from telepresence.teleop.floor_goal import ARRIVED
from telepresence.teleop.floor_projection import pixel_of
from telepresence.teleop.robot_readings import CameraView

STEP, MOST_STEPS = 0.05, 400
"""[m] between two points of the band's edges, and how many there are at most."""
RING = 32
"""Corners of the ring."""
Pixel = tuple[float, float]


class FloorBand(NamedTuple):
    """Corners of two polygons [px]; they may lie outside the picture. `edge` is empty where the robot is there already;
    what is behind the lens is left out."""

    edge: list[Pixel]
    ring: list[Pixel]


def floor_band(
    view: CameraView,
    start: tuple[float, float],
    target: tuple[float, float],
    radius: float,
    step: float = STEP,
) -> FloorBand:
    """Return the band to a place.

    Args:
        start, target: In the frame of `view` [m].
        radius: The robot's [m].
        step: Between two points of the band's edges [m].
    """
    here, there = np.array(start, float), np.array(target, float)
    length = float(np.linalg.norm(there - here))
    edge: list[Pixel] = []
    if length > 1e-3:
        along = (there - here) / length
        aside = np.array((-along[1], along[0])) * radius
        count = min(MOST_STEPS, math.ceil(length / step))
        steps = [here + along * (length * number / count) for number in range(count + 1)]
        left = [pixel_of(view, *(point + aside)) for point in steps]
        right = [pixel_of(view, *(point - aside)) for point in steps]
        edge = [pixel for pixel in left if pixel] + [pixel for pixel in reversed(right) if pixel]
    ring = [
        pixel_of(view, *(there + ARRIVED * np.array((math.cos(turn), math.sin(turn)))))
        for turn in np.linspace(0.0, math.tau, RING)
    ]
    return FloorBand(edge, [pixel for pixel in ring if pixel])
