"""Obstacles of one tick, measured against the outline."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .braking import VelocityBounds
from .outline import Outline
from .plane import squared_lengths
from .robot_profile import Limits, RobotProfile
from .sonar import Echo

FASTEST_PERSON = 1.6
"""Walking speed to assume (ISO 13855) [m/s]."""
SWERVE = math.radians(30.0)
"""How far a walking person may deviate from the direction that was measured [rad]."""
INTO_CONE = math.cos(math.radians(42.0))
"""Driving within this angle of a sonar's axis is driving into its cone."""
BRIDGED = (0.08, 0.30)
"""Neighbours this far apart are joined by a surface: no robot fits between them [m]. So a wall that is seen only where
beams hit it is a wall between the beams too, and a robot that is driven against it slides along it. A laser needs no
bridges: its beams hit a wall everywhere."""
ON_A_BRIDGE = np.array([0.25, 0.5, 0.75])[:, None, None]
BRIDGES_WITHIN = 0.25
"""Only obstacles nearer to base_link than the outline and this are joined [m]."""


@dataclass(frozen=True)
class Obstacles:
    """Obstacles near enough to limit the motion, in base_link; first axis: obstacle.

    Attributes:
        points: (n, 2) [m].
        normals, levers: As from `Outline.measure`.
        room: (n,) distance from the outline less the side margin and the uncertainty of the position [m].
        passing: (n,) room to leave when passing [m]; infinity where passing is not allowed.
        least_share: (n,) a motion that closes on an obstacle with a smaller share of its speed ignores it.
        coming: (n,) speed at which they approach on their own [m/s].
        gap: Distance from the outline to the nearest one [m]; infinity if there is none.
    """

    points: np.ndarray
    normals: np.ndarray
    levers: np.ndarray
    room: np.ndarray
    passing: np.ndarray
    least_share: np.ndarray
    coming: np.ndarray
    gap: float

    @classmethod
    def around(cls, profile: RobotProfile, points: np.ndarray, drift: np.ndarray, velocities: np.ndarray) -> Obstacles:
        """Measure obstacles against the outline.

        Args:
            points: (n, 2) base_link [m].
            drift: (n,) how far odometry may have misplaced them [m].
            velocities: (n, 2) base_link [m/s].
        """
        limits = profile.limits
        if profile.sparse:
            bridges, bridge_drift = _bridges(points, drift, velocities, profile.outline.outer_radius + BRIDGES_WITHIN)
            points, drift = np.concatenate([points, bridges]), np.concatenate([drift, bridge_drift])
            velocities = np.concatenate([velocities, np.zeros_like(bridges)])
        distance, normals, levers = profile.outline.measure(points)
        gap = float(distance.min()) if len(distance) else math.inf
        room = distance - limits.margin_beside - drift
        coming = _coming(normals, velocities)
        rest = limits.reaction + limits.max_speed / limits.braking
        near = room < profile.farthest_room + coming * rest
        passing = limits.margin_passing + drift
        none = np.zeros(np.count_nonzero(near))
        return cls(points[near], normals[near], levers[near], room[near], passing[near], none, coming[near], gap)

    def with_contact(self, normal: tuple[float, float]) -> Obstacles:
        """Return these and an obstacle that touches the robot in a direction, and that nothing may pass."""
        return self._with(np.asarray(normal), np.asarray(normal), -1.0, 0.0)

    def with_echo(self, echo: Echo, profile: RobotProfile) -> Obstacles:
        """Return these and an obstacle right across a sonar's cone, which limits only motion into the cone."""
        rim = float((profile.outline.corners @ echo.axis).max()) + profile.outline.radius
        room = float(echo.place @ echo.axis) - rim - profile.limits.margin_beside
        return self._with(echo.place, echo.axis, room, INTO_CONE)

    def _with(self, point: np.ndarray, normal: np.ndarray, room: float, least_share: float) -> Obstacles:
        return Obstacles(
            np.concatenate([self.points, [point]]),
            np.concatenate([self.normals, [normal]]),
            np.append(self.levers, 0.0),
            np.append(self.room, room),
            np.append(self.passing, math.inf),
            np.append(self.least_share, least_share),
            np.append(self.coming, 0.0),
            self.gap,
        )

    def velocity_bounds(
        self, limits: Limits, outline: Outline, room: np.ndarray, turns: tuple[float, ...]
    ) -> VelocityBounds:
        """Return the bounds that these obstacles put on the velocity.

        Args:
            room: What turning has left of `self.room`.
            turns: How far the body may have turned when the velocity takes effect [rad]; the bounds hold for all.
        """
        points, normals = self.points, self.normals
        passing, least_share, coming = self.passing, self.least_share, self.coming
        if len(turns) > 1:
            points, normals = _turned_back(points, turns), _turned_back(normals, turns)
            room, passing, least_share, coming = (
                values.repeat(len(turns)) for values in (room, passing, least_share, coming)
            )
        extra = limits.margin_ahead - limits.margin_beside
        return VelocityBounds(
            points,
            normals,
            room,
            passing,
            least_share,
            coming,
            extra,
            limits.reaction,
            limits.braking,
            outline.corners,
            outline.radius,
        )


def _bridges(
    points: np.ndarray, drift: np.ndarray, velocities: np.ndarray, within: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return points between neighbours that belong together, and their drift."""
    which = np.flatnonzero((squared_lengths(points) < within * within) & ~velocities.any(axis=1))
    if len(which) < 2:
        return np.empty((0, 2)), np.empty(0)
    which = which[np.argsort(np.arctan2(points[which, 1], points[which, 0]), kind="stable")]
    here, there = points[which], points[np.roll(which, -1)]
    apart = squared_lengths(there - here)
    low, high = BRIDGED
    joined = (apart > low * low) & (apart < high * high)
    here, there = here[joined], there[joined]
    drift = np.maximum(drift[which], drift[np.roll(which, -1)])[joined]
    return (here + ON_A_BRIDGE * (there - here)).reshape(-1, 2), np.tile(drift, len(ON_A_BRIDGE))


def _coming(normals: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Return the speed at which movers approach the robot if they turn towards it by up to `SWERVE` (n,) [m/s]."""
    speed = np.sqrt(squared_lengths(velocities))
    if not speed.any():
        return speed
    cosine = np.clip(-np.einsum("ij,ij->i", normals, velocities) / np.maximum(speed, 1e-9), -1.0, 1.0)
    return np.clip(speed * np.cos(np.maximum(np.arccos(cosine) - SWERVE, 0.0)), 0.0, FASTEST_PERSON)


def _turned_back(vectors: np.ndarray, angles: tuple[float, ...]) -> np.ndarray:
    """Return each vector in the frame of a body turned by each of the angles [rad]; shape (n * angles, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    turned = np.empty((len(vectors), len(angles), 2))
    turned[:, :, 0] = vectors[:, :1] * c + vectors[:, 1:] * s
    turned[:, :, 1] = vectors[:, 1:] * c - vectors[:, :1] * s
    return turned.reshape(-1, 2)
