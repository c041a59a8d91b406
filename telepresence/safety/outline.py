"""The robot's outline on the floor: how far an obstacle is from it, in which direction, and what turning does to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .plane import squared_lengths


@dataclass(frozen=True)
class Outline:
    """A convex polygon grown by a radius; a single vertex makes a disc.

    Args:
        vertices: Corners of the inner polygon in base_link, counter-clockwise [m].
        radius: What surrounds the polygon [m]; positive.
    """

    vertices: tuple[tuple[float, float], ...]
    radius: float

    def __post_init__(self) -> None:
        if not self.vertices or not self.radius > 0.0:
            raise ValueError("an outline needs at least one vertex and a positive radius")
        if len(self.vertices) > 2 and not self._turns_left():
            raise ValueError(f"the vertices must form a convex polygon, counter-clockwise: {self.vertices}")

    @classmethod
    def disc(cls, radius: float) -> Outline:
        return cls(((0.0, 0.0),), radius)

    @cached_property
    def outer_radius(self) -> float:
        """Radius of the circle around base_link that contains the outline [m]."""
        return max(math.hypot(x, y) for x, y in self.vertices) + self.radius

    def measure(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Measure points against the outline.

        Args:
            points: Shape (n, 2), in base_link [m].
        Returns:
            distance: (n,) from the rim [m]; negative inside.
            normal: (n, 2) unit vectors from the nearest point of the rim to the point.
            lever: (n,) [m]; times a turning rate [rad/s] it is the speed at which that point of the rim approaches
                the point [m/s].
        """
        if len(self.vertices) == 1:
            nearest = np.broadcast_to(self.corners[0], points.shape)
            inside = np.zeros(len(points), bool)
        else:
            nearest, inside = self._nearest(points)
        away = points - nearest
        distance = np.sqrt(squared_lengths(away))
        touching = distance < 1e-9
        normal = away / np.where(touching, 1.0, distance)[:, None]
        if touching.any():
            normal[touching] = _directions(points[touching])
        sign = np.where(inside, -1.0, 1.0)
        normal *= sign[:, None]
        lever = nearest[:, 0] * normal[:, 1] - nearest[:, 1] * normal[:, 0]
        return sign * distance - self.radius, normal, lever

    def reach(self, bearings: np.ndarray) -> np.ndarray:
        """Return the distance from base_link, which lies inside, to the rim in each direction (n,) [m]."""
        directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        low: np.ndarray = np.zeros(len(bearings))
        high: np.ndarray = np.full(len(bearings), self.outer_radius)
        for _ in range(20):
            middle = 0.5 * (low + high)
            inside = self.measure(middle[:, None] * directions)[0] < 0.0
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return high

    @cached_property
    def corners(self) -> np.ndarray:
        """The vertices as an array (k, 2) [m]."""
        return np.array(self.vertices, float)

    @cached_property
    def _edges(self) -> np.ndarray:
        return np.roll(self.corners, -1, axis=0) - self.corners

    def _nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the nearest point of the polygon's border for every point, and which points lie inside."""
        offset = points[:, None, :] - self.corners
        edges = self._edges
        along = (offset * edges).sum(2) / (edges**2).sum(1)
        foot = self.corners + np.clip(along, 0.0, 1.0)[:, :, None] * edges
        squared = ((points[:, None, :] - foot) ** 2).sum(2)
        best = squared.argmin(1)
        inside = np.zeros(len(points), bool)
        if len(self.vertices) > 2:
            inside = (edges[:, 0] * offset[:, :, 1] - edges[:, 1] * offset[:, :, 0] > 0.0).all(1)
        return foot[np.arange(len(points)), best], inside

    def _turns_left(self) -> bool:
        after = np.roll(self._edges, -1, axis=0)
        return bool((self._edges[:, 0] * after[:, 1] - self._edges[:, 1] * after[:, 0] > 0.0).all())


def _directions(points: np.ndarray) -> np.ndarray:
    """Return unit vectors from the origin to points; straight ahead for the origin itself."""
    length = np.hypot(points[:, 0], points[:, 1])
    ahead = np.broadcast_to([1.0, 0.0], points.shape)
    return np.where((length < 1e-9)[:, None], ahead, points / np.maximum(length, 1e-9)[:, None])
