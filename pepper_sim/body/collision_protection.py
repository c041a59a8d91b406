"""External collision protection: how fast the base may approach what its sensors detect.

The gap to an obstacle limits the speed of approach; motion that does not shorten a gap is never limited, so the robot
can always back away. Distances: pages reflexes-external-collision and control-walk of the NAOqi 2.8 documentation.
"""

from __future__ import annotations

import math

import numpy as np

from pepper_sim.body.description import (
    OUTLINE_RADIUS,
    SECURITY_DISTANCE_AHEAD,
    SECURITY_DISTANCE_BESIDE,
    WHEEL_CENTRES,
)

_SPEEDS = np.array([0.0, 0.1, 0.2, 0.3, 0.35, 0.4, 0.5])
_DISTANCES = np.array([0.10, 0.12, 0.17, 0.25, 0.30, 0.35, 0.40])
"""Distance kept in front [m] as a function of speed [m/s]; the value at standstill is the tangential distance's."""

_REACH = 0.45
"""Obstacles farther from the robot's centre than this plus the orthogonal distance [m] cannot limit any speed before
the next scan, and are not kept: 0.26 m of body, 0.09 m driven between two scans, and some margin."""

_TRIANGLE = np.array(WHEEL_CENTRES)
_EDGES = np.roll(_TRIANGLE, -1, axis=0) - _TRIANGLE
_EDGE_LENGTHS_SQUARED = (_EDGES**2).sum(axis=1)


class SecurityZone:
    """Limits translation towards obstacles. Turning on the spot stays free: the outline is nearly round."""

    def __init__(self) -> None:
        self.enabled = True
        self.orthogonal = SECURITY_DISTANCE_AHEAD
        self.tangential = SECURITY_DISTANCE_BESIDE
        self._obstacles: dict[str, np.ndarray] = {}
        self._points = np.zeros((0, 2))

    def reset(self) -> None:
        """Forget all obstacles; the distances and `enabled` stay as they are."""
        self._obstacles.clear()
        self._points = np.zeros((0, 2))

    def update(self, sensor: str, points: np.ndarray, pose: tuple[float, float, float]) -> None:
        """Replace the obstacles that `sensor` detected.

        Args:
            points: Obstacles in base_footprint, shape (n, 2) [m].
            pose: Odometry at that instant (x, y, theta).
        """
        near = points[np.hypot(points[:, 0], points[:, 1]) < self.orthogonal + _REACH]
        if not len(near) and sensor not in self._obstacles:
            return
        x, y, theta = pose
        c, s = math.cos(theta), math.sin(theta)
        self._obstacles[sensor] = near @ np.array([[c, s], [-s, c]]) + (x, y)
        self._points = np.concatenate(list(self._obstacles.values()))

    def limit(self, vx: float, vy: float, pose: tuple[float, float, float]) -> tuple[float, tuple[float, float] | None]:
        """Return how much of a translation is allowed.

        Args:
            vx, vy: Requested velocity in base_footprint [m/s].
            pose: Odometry now (x, y, theta).
        Returns:
            Factor 0...1 for the velocity, and the obstacle that decided it (x, y in the odometry frame) or None.
        """
        speed = math.hypot(vx, vy)
        if not self.enabled or not len(self._points) or speed == 0.0:
            return 1.0, None
        x, y, theta = pose
        c, s = math.cos(theta), math.sin(theta)
        local = (self._points - (x, y)) @ np.array([[c, -s], [s, c]])
        gaps, normals = gap_to_outline(local)
        facing = normals @ (vx / speed, vy / speed)
        ahead = facing > 1e-3
        if not ahead.any():
            return 1.0, None
        facing, gaps = facing[ahead], gaps[ahead]
        scale = self.orthogonal / SECURITY_DISTANCE_AHEAD
        stop = facing * _DISTANCES[0] * scale + (1.0 - facing) * min(self.tangential, self.orthogonal)
        # The table between standstill and the first moving entry starts at `stop`, which differs per obstacle.
        table = np.interp(gaps, _DISTANCES * scale, _SPEEDS, right=np.inf)
        near = gaps < _DISTANCES[1] * scale
        span = np.maximum(_DISTANCES[1] * scale - stop, 1e-3)
        table[near] = (np.clip((gaps - stop) / span, 0.0, 1.0) * _SPEEDS[1])[near]
        table[gaps <= stop] = 0.0
        factors = table / (facing * speed)
        worst = int(np.argmin(factors))
        if factors[worst] >= 1.0:
            return 1.0, None
        obstacle = self._points[np.flatnonzero(ahead)[worst]]
        return float(factors[worst]), (float(obstacle[0]), float(obstacle[1]))


def gap_to_outline(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each point's distance from the base's outline and the direction away from it.

    Args:
        points: In base_footprint, shape (n, 2) [m].
    Returns:
        Gaps [m], shape (n,), negative inside; unit vectors from the outline to the points, shape (n, 2).
    """
    offsets = points[:, None, :] - _TRIANGLE
    along = np.clip((offsets * _EDGES).sum(axis=2) / _EDGE_LENGTHS_SQUARED, 0.0, 1.0)
    away = offsets - along[:, :, None] * _EDGES
    distances = np.hypot(away[:, :, 0], away[:, :, 1])
    nearest = distances.argmin(axis=1)
    rows = np.arange(len(points))
    away, distance = away[rows, nearest], distances[rows, nearest]
    # Left of every edge means inside: the wheels are listed counter-clockwise.
    inside = (_EDGES[:, 0] * offsets[:, :, 1] - _EDGES[:, 1] * offsets[:, :, 0] > 0.0).all(axis=1)
    sign = np.where(inside, -1.0, 1.0)
    normals = sign[:, None] * away / np.maximum(distance, 1e-9)[:, None]
    return sign * distance - OUTLINE_RADIUS, normals
