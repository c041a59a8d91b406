"""Curved shells of Pepper's body, lofted from cross sections; our own shapes.

Frame positions and outer dimensions are public, the maker's meshes are not free: the outline here is drawn around the
published frames and within 1210 x 480 x 425 mm.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

WHEELS = ((0.09, 0.155), (-0.17, 0.0), (0.09, -0.155))
"""Wheel centres around base_footprint, x forward and y left [m]; source: pepper.urdf of ros-naoqi/pepper_robot."""
OUTLINE_RADIUS = 0.085
"""The base's outline is the wheels' triangle widened by this [m]: 480 mm wide and 430 mm long."""
HULL_BOTTOM, HULL_TOP = 0.03, 0.25

_ARC_POINTS = 5


def outline(radius: float = OUTLINE_RADIUS, arc_points: int = _ARC_POINTS) -> np.ndarray:
    """The base's outline seen from above, counter-clockwise, shape (n, 2) [m]."""
    points = []
    wheels = np.array(WHEELS)
    for i, wheel in enumerate(wheels):
        before, after = wheel - wheels[i - 1], wheels[(i + 1) % 3] - wheel
        start = math.atan2(before[1], before[0]) - math.pi / 2
        turn = math.remainder(math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]), math.tau)
        for k in range(arc_points):
            angle = start + turn * k / (arc_points - 1)
            points.append(wheel + radius * np.array([math.cos(angle), math.sin(angle)]))
    return np.array(points)


def add_shells(spec: mujoco.MjSpec) -> None:
    """Add the meshes that `pepper.xml` names to its spec."""
    ring = outline()
    low = np.column_stack([ring, np.full(len(ring), HULL_BOTTOM)])
    high = np.column_stack([ring, np.full(len(ring), HULL_TOP)])
    spec.add_mesh(name="base_hull", uservert=np.vstack([low, high]).ravel())
