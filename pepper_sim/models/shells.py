"""Curved shells of Pepper's body, lofted from cross sections; our own shapes.

Frame positions and outer dimensions are public, the manufacturer's meshes are not free: this outline is drawn around
the published frames and within 1210 x 480 x 425 mm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from pepper_sim.body.description import OUTLINE_RADIUS, WHEEL_CENTRES

HULL_BOTTOM, HULL_TOP = 0.03, 0.25

SIDES = 28
"""Corners of a cross section."""

Section = tuple[float, float, float, float]
"""Height, centre, half width along the first and along the second axis [m]."""

# Heights are in the body's own frame (see pepper.xml); the centre shifts along x.
_THIGH: tuple[Section, ...] = (
    (-0.262, 0.0, 0.060, 0.060),
    (-0.255, 0.0, 0.078, 0.080),
    (-0.20, 0.0, 0.086, 0.090),
    (-0.12, 0.002, 0.090, 0.103),
    (-0.05, 0.002, 0.094, 0.120),
    (0.0, 0.0, 0.096, 0.130),
    (0.03, -0.002, 0.088, 0.124),
    (0.05, -0.004, 0.066, 0.096),
    (0.056, -0.004, 0.040, 0.060),
)
_TORSO: tuple[Section, ...] = (
    (-0.122, -0.004, 0.045, 0.060),
    (-0.115, -0.004, 0.064, 0.082),
    (-0.085, -0.006, 0.080, 0.100),
    (-0.03, -0.012, 0.092, 0.112),
    (0.03, -0.022, 0.091, 0.124),
    (0.075, -0.032, 0.085, 0.130),
    (0.105, -0.038, 0.074, 0.120),
    (0.125, -0.040, 0.058, 0.092),
    (0.136, -0.040, 0.036, 0.056),
)
_HEAD: tuple[Section, ...] = (
    (-0.006, -0.012, 0.030, 0.034),
    (0.004, -0.011, 0.052, 0.058),
    (0.03, -0.008, 0.079, 0.084),
    (0.065, -0.006, 0.096, 0.102),
    (0.10, -0.007, 0.1015, 0.111),
    (0.135, -0.009, 0.100, 0.112),
    (0.165, -0.011, 0.093, 0.104),
    (0.19, -0.013, 0.079, 0.088),
    (0.207, -0.014, 0.058, 0.065),
    (0.216, -0.015, 0.036, 0.040),
    (0.220, -0.015, 0.012, 0.013),
)
# Arms run along x; the sections' axes are y and z.
_UPPER_ARM: tuple[Section, ...] = (
    (0.0, 0.0, 0.030, 0.030),
    (0.012, 0.002, 0.046, 0.047),
    (0.05, 0.006, 0.048, 0.050),
    (0.11, 0.012, 0.042, 0.043),
    (0.15, 0.014, 0.038, 0.038),
    (0.162, 0.015, 0.028, 0.028),
)
_FOREARM: tuple[Section, ...] = (
    (0.022, 0.0, 0.024, 0.024),
    (0.030, 0.0, 0.034, 0.035),
    (0.06, 0.002, 0.041, 0.043),
    (0.10, 0.002, 0.039, 0.042),
    (0.14, 0.0, 0.031, 0.036),
    (0.152, 0.0, 0.022, 0.026),
)
_HAND: tuple[Section, ...] = (
    (0.006, 0.0, 0.018, 0.018),
    (0.018, 0.0, 0.027, 0.022),
    (0.045, 0.0, 0.038, 0.023),
    (0.07, 0.0, 0.039, 0.019),
    (0.084, 0.0, 0.034, 0.014),
    (0.09, 0.0, 0.022, 0.008),
)

# The base's sections: height, part of the outline (0: an ellipse that carries the leg), and size.
_BASE: tuple[tuple[float, float, float], ...] = (
    (0.022, 1.0, 0.90),
    (0.030, 1.0, 0.965),
    (0.05, 1.0, 0.985),
    (0.13, 1.0, 0.985),
    (0.17, 0.97, 0.955),
    (0.205, 0.88, 0.88),
    (0.235, 0.72, 0.76),
    (0.262, 0.50, 0.66),
    (0.285, 0.25, 0.68),
    (0.305, 0.0, 0.92),
    (0.325, 0.0, 0.86),
    (0.332, 0.0, 0.62),
)
_LEG_RADIUS = (0.098, 0.102)
_BUMPER: tuple[tuple[float, float, float], ...] = (
    (0.052, 1.0, 0.97),
    (0.056, 1.0, 1.0),
    (0.084, 1.0, 1.0),
    (0.088, 1.0, 0.97),
)


def outline(angles: np.ndarray) -> np.ndarray:
    """Return the distance of the base's outline from its centre [m] in each direction [rad]; shape as `angles`."""
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    reach = np.zeros(np.shape(angles))
    wheels = np.array(WHEEL_CENTRES)
    for i, wheel in enumerate(wheels):
        # Round corner: the far crossing of a ray from the centre with the circle around the wheel.
        along = directions @ wheel
        under = along**2 - wheel @ wheel + OUTLINE_RADIUS**2
        corner = along + np.sqrt(np.maximum(under, 0.0))
        reach = np.maximum(reach, np.where(under >= 0.0, corner, 0.0))
        # Straight side between two corners, if the ray crosses it between the tangent points.
        after = wheels[(i + 1) % len(wheels)]
        side = (after - wheel) / np.linalg.norm(after - wheel)
        normal = np.array([side[1], -side[0]])
        facing = directions @ normal
        distance = (normal @ wheel + OUTLINE_RADIUS) / np.where(facing > 1e-6, facing, np.inf)
        position = (distance[..., None] * directions - wheel) @ side
        on_side = (facing > 1e-6) & (position >= 0.0) & (position <= np.linalg.norm(after - wheel))
        reach = np.maximum(reach, np.where(on_side, distance, 0.0))
    return reach


def loft(rings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Close a stack of rings into a solid.

    Args:
        rings: Shape (sections, sides, 3) [m], counter-clockwise around the direction in which they are stacked.
    Returns:
        Vertices (n, 3) and triangles (m, 3), facing outwards.
    """
    count, sides, _ = rings.shape
    vertices = np.vstack([rings.reshape(-1, 3), rings[0].mean(axis=0), rings[-1].mean(axis=0)])
    bottom, top = count * sides, count * sides + 1
    triangles = []
    for k in range(sides):
        following = (k + 1) % sides
        triangles.append((bottom, following, k))
        triangles.append((top, (count - 1) * sides + k, (count - 1) * sides + following))
        for ring in range(count - 1):
            a, b = ring * sides + k, ring * sides + following
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return vertices, np.array(triangles)


def add_shells(spec: mujoco.MjSpec) -> None:
    """Add the meshes that `pepper.xml` names to its spec."""
    angles = np.arange(SIDES) * math.tau / SIDES
    low, high = (_base_ring(height, 1.0, 1.0, angles) for height in (HULL_BOTTOM, HULL_TOP))
    spec.add_mesh(name="base_hull", uservert=np.vstack([low, high]).ravel())
    _add(spec, "base", np.array([_base_ring(*section, angles) for section in _BASE]))
    _add(spec, "bumper", np.array([_base_ring(*section, angles) for section in _BUMPER]))
    for name, sections in (("thigh", _THIGH), ("torso", _TORSO), ("head", _HEAD)):
        _add(spec, name, _upright(sections, angles))
    for name, sections in (("upper_arm", _UPPER_ARM), ("forearm", _FOREARM), ("hand", _HAND)):
        left = _forward(sections, angles)
        _add(spec, f"left_{name}", left)
        _add(spec, f"right_{name}", (left * (1.0, -1.0, 1.0))[:, ::-1])


def _add(spec: mujoco.MjSpec, name: str, rings: np.ndarray) -> None:
    vertices, triangles = loft(rings)
    spec.add_mesh(name=name, uservert=vertices.ravel(), userface=triangles.ravel().astype(np.int32), smoothnormal=1)


def _base_ring(height: float, part: float, size: float, angles: np.ndarray) -> np.ndarray:
    a, b = _LEG_RADIUS
    ellipse = a * b / np.hypot(b * np.cos(angles), a * np.sin(angles))
    reach = size * (part * outline(angles) + (1.0 - part) * ellipse)
    return np.stack([reach * np.cos(angles), reach * np.sin(angles), np.full_like(angles, height)], axis=1)


def _upright(sections: Sequence[Section], angles: np.ndarray) -> np.ndarray:
    rings = [
        np.stack([centre + a * np.cos(angles), b * np.sin(angles), np.full_like(angles, height)], axis=1)
        for height, centre, a, b in sections
    ]
    return np.array(rings)


def _forward(sections: Sequence[Section], angles: np.ndarray) -> np.ndarray:
    rings = [
        np.stack([np.full_like(angles, along), centre + a * np.cos(angles), b * np.sin(angles)], axis=1)
        for along, centre, a, b in sections
    ]
    return np.array(rings)
