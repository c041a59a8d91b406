"""One law for every obstacle: come no nearer than what lets the robot stop in time.

For an obstacle at distance d from the outline in direction n, a velocity v that closes on it with the share
c = n·v/|v| of its length is allowed if

    c (|v| tau + |v|²/2a) + (m_ahead - m_beside) c²  <=  d - m_beside

Something that comes nearer by itself at a speed w takes w (tau + |v|/a) more: the robot stands when it arrives.

Left: what reacting and then braking along v takes off the distance, and the wider margin for driving straight at
something. The distance to a convex outline along a straight line is convex, so its slope at the start bounds what is
lost: the robot can always stop short of the margin. c <= 0 is always allowed: any motion away, and along a wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

_STRAIGHT = 1e-9
"""Closing shares below this are motion along the obstacle."""
MOST_CONSTRAINTS = 48
"""Obstacles considered for the direction; the tightest ones. The speed is always checked against all."""


def stopping_speed(distance: np.ndarray | float, reaction: np.ndarray | float, braking: float) -> np.ndarray | float:
    """Fastest speed that stops within a distance: solves v tau + v²/2a = d, for d >= 0.

    Args:
        distance: [m]; infinity allowed.
        reaction, braking: tau [s] and a [m/s²].
    """
    return braking * (np.sqrt(reaction * reaction + 2.0 * distance / braking) - reaction)


def stopping_distance(speed: float, reaction: float, braking: float) -> float:
    """Distance driven until standing [m]."""
    return speed * reaction + 0.5 * speed * speed / braking


@dataclass(frozen=True)
class Guard:
    """Obstacles around the robot as bounds on its velocity.

    Args:
        room: (n,) distance of each obstacle from the outline, less the margin beside and its uncertainty [m].
        normals: (n, 2) unit vectors from the outline to the obstacles, base_link.
        coming: (n,) speed at which they come nearer by themselves [m/s].
        extra: Margin ahead less margin beside [m], not negative.
        reaction, braking: tau [s], a [m/s²].
    """

    room: np.ndarray
    normals: np.ndarray
    coming: np.ndarray
    extra: float
    reaction: float
    braking: float

    def speed_towards(self, directions: np.ndarray) -> np.ndarray:
        """Fastest straight driving in each direction [m/s], infinity where nothing is in the way.

        Args:
            directions: (2, k) unit vectors as columns.
        """
        if not len(self.room):
            return np.full(directions.shape[1], math.inf)
        share = self.normals @ directions
        ahead = share > _STRAIGHT
        share = np.where(ahead, share, 1.0)
        # share (v tau + v²/2a) + coming (tau + v/a) = left, solved for v: as for a distance and a longer reaction.
        left = self.room[:, None] - self.extra * share * share - (self.coming * self.reaction)[:, None]
        distance = np.where(ahead, left / share, math.inf)
        if not self.coming.any():
            return stopping_speed(np.maximum(distance.min(axis=0), 0.0), self.reaction, self.braking)
        reaction = self.reaction + self.coming[:, None] / (self.braking * share)
        return stopping_speed(np.maximum(distance, 0.0), reaction, self.braking).min(axis=0)

    def nearest_allowed(self, vx: float, vy: float) -> tuple[float, float]:
        """The allowed velocity nearest to (vx, vy): towards obstacles it is cut, along them and away it stays."""
        speed = math.hypot(vx, vy)
        if speed < _STRAIGHT or not len(self.room):
            return vx, vy
        wanted = np.array([vx, vy])
        velocity = wanted
        # The bounds depend on the speed that results: start with the fastest, close in on where both agree.
        bound_at = speed
        for _ in range(3):
            velocity = self._project(wanted, speed, bound_at)
            found = math.hypot(velocity[0], velocity[1])
            if found > 0.98 * bound_at:
                break
            bound_at = 0.5 * (bound_at + found)
        length = math.hypot(velocity[0], velocity[1])
        if length < _STRAIGHT:
            return 0.0, 0.0
        ux, uy = float(velocity[0]) / length, float(velocity[1]) / length
        fastest = float(self.speed_towards(np.array([[ux], [uy]]))[0])
        length = min(fastest, ux * vx + uy * vy)
        return (ux * length, uy * length) if length > 0.0 else (0.0, 0.0)

    def _project(self, wanted: np.ndarray, speed: float, bound_at: float) -> np.ndarray:
        """Nearest velocity under the half planes that the law gives for driving at `bound_at`."""
        distance = stopping_distance(bound_at, self.reaction, self.braking)
        taken = self.coming * (self.reaction + bound_at / self.braking)
        room = np.maximum(self.room - taken, 0.0)
        if self.extra > 0.0:
            share = (np.sqrt(distance * distance + 4.0 * self.extra * room) - distance) / (2.0 * self.extra)
        else:
            share = room / distance
        bounds = bound_at * share
        matter = np.flatnonzero(bounds < speed)
        if len(matter) > MOST_CONSTRAINTS:
            matter = matter[np.argpartition(bounds[matter], MOST_CONSTRAINTS)[:MOST_CONSTRAINTS]]
        return project(wanted, self.normals[matter], bounds[matter])


def project(wanted: np.ndarray, normals: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """The point nearest to `wanted` with normals @ point <= bounds; exact, for bounds >= 0.

    It is `wanted` itself or lies on the line of a bound that `wanted` breaks. For every such line the others leave an
    interval; the nearest point of the nearest interval is the answer.
    """
    broken = np.flatnonzero(normals @ wanted > bounds + 1e-12)
    if not len(broken):
        return wanted
    normal, bound = normals[broken], bounds[broken]
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    slope = normals @ along.T
    slack = bounds[:, None] - (normals @ normal.T) * bound
    flat = np.abs(slope) < 1e-9
    limit = slack / np.where(flat, 1.0, slope)
    high = np.where(flat | (slope < 0.0), math.inf, limit).min(axis=0)
    low = np.where(flat | (slope > 0.0), -math.inf, limit).max(axis=0)
    possible = (low <= high + 1e-9) & ~(flat & (slack < -1e-9)).any(axis=0)
    if not possible.any():
        return np.zeros(2)
    at = np.clip(along @ wanted, low, np.maximum(low, high))
    points = bound[:, None] * normal + at[:, None] * along
    error = ((points - wanted) ** 2).sum(axis=1)
    return points[np.where(possible, error, math.inf).argmin()]


def turning_rate(
    wanted: float, room: np.ndarray, levers: np.ndarray, reaction: float, braking: float
) -> tuple[float, np.ndarray]:
    """The turning rate that leaves every obstacle its room, and the room that is left for driving.

    Args:
        wanted: [rad/s].
        room: (n,) as in `Guard` [m].
        levers: (n,) as from `Outline.measure` [m].
        reaction, braking: tau [s], angular deceleration [rad/s²].
    """
    nearing = levers * math.copysign(1.0, wanted)
    towards = nearing > _STRAIGHT
    if wanted == 0.0 or not towards.any():
        return wanted, room
    arc = np.where(towards, np.maximum(room, 0.0) / np.where(towards, nearing, 1.0), math.inf)
    rate = min(abs(wanted), float(stopping_speed(arc.min(), reaction, braking)))
    taken = np.where(towards, nearing, 0.0) * stopping_distance(rate, reaction, braking)
    return math.copysign(rate, wanted), room - taken
