"""One rule for every obstacle: keep the distance that the robot needs to stop in time.

For an obstacle at distance d from the outline in direction n, a velocity v that closes on it with the share
c = n·v/|v| of its length is allowed if

    c (|v| tau + |v|²/2a) + (m_ahead - m_beside) c²  <=  d - m_beside

or if the strip that the outline sweeps along v passes it at m_passing or more. Something that approaches on its own
at a speed w takes w (tau + |v|/a) more: the robot stands when it arrives.

The left side is what reacting and then braking along v takes off the distance, and the wider margin for driving
straight at something. The distance to a convex outline along a straight line is convex, so its slope at the start
bounds what is lost: the robot can always stop short of the margin. c <= 0 is always allowed: any motion away from an
obstacle, and along a wall.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import overload

import numpy as np

from .plane import left_of

_STRAIGHT = 1e-9
"""Closing shares below this are motion along the obstacle."""
MOST_CUTS = 6
"""Most obstacles that may change the direction. The speed is always checked against all."""


@overload
def stopping_speed(distance: float, reaction: float, braking: float) -> float: ...


@overload
def stopping_speed(distance: np.ndarray, reaction: np.ndarray | float, braking: float) -> np.ndarray: ...


def stopping_speed(distance: np.ndarray | float, reaction: np.ndarray | float, braking: float) -> np.ndarray | float:
    """Return the fastest speed that stops within a distance: solves v tau + v²/2a = d, for d >= 0.

    Args:
        distance: [m]; infinity allowed.
        reaction, braking: tau [s] and a [m/s²].
    """
    return braking * (np.sqrt(reaction * reaction + 2.0 * distance / braking) - reaction)


def stopping_distance(speed: float, reaction: float, braking: float) -> float:
    """Return the distance driven until the robot stands [m]."""
    return speed * reaction + 0.5 * speed * speed / braking


@dataclass(frozen=True)
class VelocityBounds:
    """Obstacles around the robot as bounds on its velocity, in base_link.

    Args:
        points: (n, 2) obstacles [m].
        normals: (n, 2) unit vectors from the outline to them.
        room: (n,) their distance from the outline less the side margin and the uncertainty of their position [m].
        passing: (n,) room to leave when driving past them [m]; infinity where passing is not allowed.
        least_share: (n,) a motion that closes on an obstacle with a smaller share ignores it.
        coming: (n,) speed at which they approach on their own [m/s].
        extra: Margin ahead less the side margin [m], not negative.
        reaction, braking: tau [s], a [m/s²].
        corners, radius: The outline: a convex polygon (k, 2), grown by a radius [m].
    """

    points: np.ndarray
    normals: np.ndarray
    room: np.ndarray
    passing: np.ndarray
    least_share: np.ndarray
    coming: np.ndarray
    extra: float
    reaction: float
    braking: float
    corners: np.ndarray
    radius: float

    def speed_towards(self, directions: np.ndarray) -> np.ndarray:
        """Return the fastest straight driving in each direction [m/s], infinity where nothing is in the way.

        Args:
            directions: (2, k) unit vectors as columns.
        """
        if not len(self.room):
            return np.full(directions.shape[1], math.inf)
        share, ahead = self._in_the_way(directions)
        share = np.where(ahead, share, 1.0)
        left = self.room[:, None] - self.extra * share * share
        come = self.coming > 0.0
        if not come.any():
            distance = np.where(ahead, left / share, math.inf).min(axis=0)
            return stopping_speed(np.maximum(distance, 0.0), self.reaction, self.braking)
        # share (v tau + v²/2a) + coming (tau + v/a) = left: as for a distance left/share and a longer reaction.
        coming = self.coming[:, None]
        distance = np.where(ahead, np.maximum(left - coming * self.reaction, 0.0) / share, math.inf)
        reaction = self.reaction + coming / (self.braking * share)
        return stopping_speed(distance, reaction, self.braking).min(axis=0)

    def nearest_allowed(self, vx: float, vy: float) -> tuple[float, float]:
        """Return the allowed velocity nearest to (vx, vy): cut towards obstacles, kept along them and away."""
        speed = math.hypot(vx, vy)
        if speed < _STRAIGHT or not len(self.room) or self._none_within_reach(speed):
            return vx, vy
        wanted = velocity = np.array([vx, vy])
        cuts: list[int] = []
        for _ in range(MOST_CUTS):
            broken = self._broken_by(velocity)
            broken[cuts] = False
            if not broken.any():
                break
            # The nearest one first: for a wall, that leaves the motion along the wall.
            cuts.append(int(np.where(broken, self.room, math.inf).argmin()))
            bound_at = math.hypot(velocity[0], velocity[1])
            velocity = project(wanted, self.normals[cuts], self._bounds(cuts, bound_at))
            if math.hypot(velocity[0], velocity[1]) < _STRAIGHT:
                return 0.0, 0.0
        length = math.hypot(velocity[0], velocity[1])
        ux, uy = float(velocity[0]) / length, float(velocity[1]) / length
        fastest = float(self.speed_towards(np.array([[ux], [uy]]))[0])
        length = min(fastest, ux * vx + uy * vy)
        return (ux * length, uy * length) if length > 0.0 else (0.0, 0.0)

    @functools.cached_property
    def nearest(self) -> tuple[float, float]:
        """The least room of any obstacle [m], and the greatest speed at which any approaches [m/s]."""
        return float(self.room.min(initial=math.inf)), float(self.coming.max(initial=0.0))

    def _none_within_reach(self, speed: float) -> bool:
        """Whether the nearest obstacle would be far enough even if it came at the robot as the fastest one does, and
        the robot drove straight at it: then none of them need be looked at."""
        room, coming = self.nearest
        taken = coming * (self.reaction + speed / self.braking) + self.extra
        return stopping_distance(speed, self.reaction, self.braking) + taken <= room

    def _in_the_way(self, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the closing share of every obstacle for every direction, and which lie in the swept strip."""
        share = self.normals @ directions
        across = directions[::-1] * [[-1.0], [1.0]]
        corners = self.corners @ across
        aside = self.points @ across
        passing = self.passing[:, None] + self.radius
        inside = (aside < corners.max(axis=0) + passing) & (aside > corners.min(axis=0) - passing)
        coming = self.coming > 0.0
        if coming.any():
            inside[coming] = True
        return share, inside & (share > np.maximum(self.least_share, _STRAIGHT)[:, None])

    def _broken_by(self, velocity: np.ndarray) -> np.ndarray:
        """Return which obstacles forbid a velocity (n,)."""
        speed = math.hypot(velocity[0], velocity[1])
        share, ahead = self._in_the_way((velocity / speed)[:, None])
        share = share[:, 0]
        taken = self.coming * (self.reaction + speed / self.braking) + self.extra * share * share
        lost = share * stopping_distance(speed, self.reaction, self.braking) + taken
        return ahead[:, 0] & (lost > np.maximum(self.room, 0.0) + 1e-9)

    def _bounds(self, which: list[int], speed: float) -> np.ndarray:
        """Return the fastest allowed closing on some obstacles when driving at `speed` (m,) [m/s]."""
        distance = stopping_distance(speed, self.reaction, self.braking)
        taken = self.coming[which] * (self.reaction + speed / self.braking)
        room = np.maximum(self.room[which] - taken, 0.0)
        if self.extra > 0.0:
            share = (np.sqrt(distance * distance + 4.0 * self.extra * room) - distance) / (2.0 * self.extra)
        else:
            share = room / distance
        return speed * share


def project(wanted: np.ndarray, normals: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Return the point nearest to `wanted` with normals @ point <= bounds; exact, for bounds >= 0.

    It is `wanted` itself or lies on the line of a bound that `wanted` breaks. For every such line the others leave an
    interval; the nearest point of the nearest interval is the answer.
    """
    broken = np.flatnonzero(normals @ wanted > bounds + 1e-12)
    if not len(broken):
        return wanted
    normal, bound = normals[broken], bounds[broken]
    along = left_of(normal)
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
    """Return the turning rate that leaves every obstacle its room, and the room that is left for driving.

    Args:
        wanted: [rad/s].
        room: (n,) as in `VelocityBounds` [m].
        levers: (n,) as from `Outline.measure` [m].
        reaction, braking: tau [s], angular deceleration [rad/s²].
    """
    if wanted == 0.0:
        return wanted, room
    nearing = levers * math.copysign(1.0, wanted)
    towards = nearing > _STRAIGHT
    if not towards.any():
        return wanted, room
    arc = np.where(towards, np.maximum(room, 0.0) / np.where(towards, nearing, 1.0), math.inf)
    rate = min(abs(wanted), float(stopping_speed(arc.min(), reaction, braking)))
    taken = np.where(towards, nearing, 0.0) * stopping_distance(rate, reaction, braking)
    return math.copysign(rate, wanted), room - taken
