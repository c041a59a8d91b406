"""Converts a pixel of the picture to the place on the floor that it shows, and back. No ROS, no Qt."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from telepresence.teleop.robot_readings import CameraView

LOWEST_SLOPE = math.sin(math.radians(2.0))
"""Sine of the smallest slope of a usable ray: below 2 degrees an error of one degree in the head's angle would move the
place by metres."""
NEAREST_DEPTH = 0.05
"""[m] in front of the lens; what is nearer is not drawn."""


class FloorPlace(NamedTuple):
    """A place on the floor [m] in the frame of the `CameraView`."""

    x: float
    y: float


def floor_place(view: CameraView, u: float, v: float, farthest: float) -> FloorPlace | None:
    """Return the place on the floor that pixel (u, v) shows; None above the horizon.

    The ray through the pixel is intersected with z = 0. An error of the pitch moves the place by h / sin^2(slope) per
    radian, so a place more than `farthest` [m] from the point below the camera is moved to that distance.
    """
    lens = view.lens
    ray = view.rotation @ ((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1.0)
    slope = -ray[2] / np.linalg.norm(ray)
    if slope < LOWEST_SLOPE or view.place[2] <= 0.0:
        return None
    away = ray[:2] * (view.place[2] / -ray[2])
    distance = float(np.hypot(*away))
    if distance > farthest:
        away = away * (farthest / distance)
    return FloorPlace(float(view.place[0] + away[0]), float(view.place[1] + away[1]))


def pixel_of(view: CameraView, x: float, y: float, z: float = 0.0) -> tuple[float, float] | None:
    """Return the pixel that shows a place [m]; None when it is behind the lens. It may lie outside the picture."""
    ahead = view.rotation.T @ (np.array((x, y, z)) - view.place)
    if ahead[2] < NEAREST_DEPTH:
        return None
    lens = view.lens
    return lens.cx + lens.fx * float(ahead[0] / ahead[2]), lens.cy + lens.fy * float(ahead[1] / ahead[2])


def scaled_to(view: CameraView, width: int, height: int) -> CameraView:
    """Return the same view for a picture of another size [px] of the same camera."""
    lens = view.lens
    if (width, height) == (lens.width, lens.height):
        return view
    a, b = width / lens.width, height / lens.height
    resized = lens.__class__(lens.fx * a, lens.fy * b, lens.cx * a, lens.cy * b, width, height, lens.frame)
    return CameraView(resized, view.rotation, view.place)
