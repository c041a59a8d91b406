"""What one tick knows: obstacles around the outline, and how fast each direction may be driven at all."""

from __future__ import annotations

import math

import numpy as np

from .braking import Guard
from .latches import BumperLatch
from .messages import SECTORS, in_words
from .profile import RobotProfile
from .surroundings import Surroundings
from .watchdogs import Health, SourceWatch

_BEARINGS = np.arange(SECTORS) * math.tau / SECTORS
_UNIT = np.stack([np.cos(_BEARINGS), np.sin(_BEARINGS)])
"""Middle of each sector as columns (2, 72)."""
CLOSED_BESIDE = 6
"""Sectors to either side of one whose sensor is silent that are closed with it: the robot is wide."""


FASTEST_PERSON = 1.6
"""Walking speed to count with (ISO 13855) [m/s]."""


SWERVE = math.radians(30.0)
"""The direction of a walking person is known, and kept, no better than this [rad]."""


class View:
    """The surroundings at one instant, in base_link.

    Attributes:
        points: (n, 2) obstacles that are near enough to limit something [m].
        room, normals, levers: (n,), (n, 2), (n,) as for `Guard` and `turning_rate`.
        coming: (n,) speed at which they come nearer by themselves [m/s].
        gap: From the outline to the nearest obstacle [m]; infinity if there is none.
        caps: (72,) fastest driving that sensors and latches permit, obstacles aside [m/s].
        bumped: A bumper is latched.
        usable: Some range source is live.
        complaint: The first sensor that is not, as a sentence; empty if all are.
    """

    def __init__(
        self,
        profile: RobotProfile,
        watches: dict[str, SourceWatch],
        place: Surroundings,
        bumper: BumperLatch,
        now: float,
        theta: float,
    ) -> None:
        limits = profile.limits
        self._limits = limits
        self.points, drift, velocities = place.obstacles(now)
        distance, self.normals, self.levers = profile.outline.measure(self.points)
        self.gap = float(distance.min()) if len(distance) else math.inf
        self.room = distance - limits.margin_beside - drift
        # The others can't limit anything.
        self.coming = _coming(self.normals, velocities)
        rest = limits.reaction + limits.max_speed / limits.braking
        near = self.room < profile.farthest_room + self.coming * rest
        self.points, self.normals = self.points[near], self.normals[near]
        self.levers, self.room, self.coming = self.levers[near], self.room[near], self.coming[near]
        self.caps, self._blind, self.usable, self.complaint = _sensor_caps(profile, watches, now)
        self.bumped = bumper.latched
        if bumper.latched:
            self.caps = np.minimum(self.caps, limits.escape_speed)
            normal = bumper.normal(theta)
            if normal is not None:
                self.points = np.concatenate([self.points, [normal]])
                self.normals = np.concatenate([self.normals, [normal]])
                self.room = np.append(self.room, -1.0)
                self.levers, self.coming = np.append(self.levers, 0.0), np.append(self.coming, 0.0)
        self.guard = self.guard_with(self.room)

    def guard_with(self, room: np.ndarray, turns: tuple[float, ...] = (0.0,)) -> Guard:
        """The guard for driving.

        Args:
            room: What turning has left of `self.room`.
            turns: How far the body may have turned when the velocity takes effect [rad]; all are guarded.
        """
        limits = self._limits
        extra = limits.margin_ahead - limits.margin_beside
        normals, coming = self.normals, self.coming
        if len(turns) > 1:
            c, s = np.cos(turns), np.sin(turns)
            x, y = normals[:, :1], normals[:, 1:]
            normals = np.stack([(x * c + y * s).ravel(), (y * c - x * s).ravel()], axis=1)
            room, coming = np.repeat(room, len(turns)), np.repeat(coming, len(turns))
        return Guard(room, normals, coming, extra, limits.reaction, limits.braking)

    def allowed(self) -> np.ndarray:
        """(72,) speed allowed straight into each sector [m/s]."""
        return np.minimum(self.guard.speed_towards(_UNIT), self.caps)

    def why(self, sector: int) -> str:
        """Why the cap of a sector is low."""
        if self.complaint and not self._blind[sector]:
            return self.complaint if self.caps[sector] == 0.0 else f"{self.complaint} Slower without it."
        return "Slow: no sensor looks there." if self._blind[sector] else "Fastest that the sensors there are good for."

    def tightest(self, vx: float, vy: float) -> int | None:
        """Index of the obstacle that limits driving along (vx, vy) most; None if none is on that side."""
        speed = math.hypot(vx, vy)
        if not len(self.room) or speed == 0.0:
            return None
        share = self.normals @ np.array([vx / speed, vy / speed])
        ahead = share > 0.01
        if not ahead.any():
            return None
        return int(np.where(ahead, self.room / np.where(ahead, share, 1.0), math.inf).argmin())

    def describe(self, index: int) -> str:
        """Obstacle `index` as a pilot says it: how far and where."""
        x, y = self.points[index]
        gap = max(0.0, float(self.room[index]) + self._limits.margin_beside)
        return f"{gap:.2f} m {in_words(math.atan2(y, x))}"


def _coming(normals: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Speed at which movers near the robot, if they turned towards it by up to `SWERVE` (n,) [m/s]."""
    speed = np.sqrt((velocities**2).sum(axis=1))
    if not speed.any():
        return speed
    cosine = np.clip(-(normals * velocities).sum(axis=1) / np.maximum(speed, 1e-9), -1.0, 1.0)
    return np.clip(speed * np.cos(np.maximum(np.arccos(cosine) - SWERVE, 0.0)), 0.0, FASTEST_PERSON)


def _sensor_caps(
    profile: RobotProfile, watches: dict[str, SourceWatch], now: float
) -> tuple[np.ndarray, np.ndarray, bool, str]:
    """Caps by what the sensors are good for; sectors that none serves; whether any is live; the first complaint."""
    caps = np.zeros(SECTORS)
    served = np.zeros(SECTORS, bool)
    watched = np.zeros(SECTORS, bool)
    complaint = ""
    usable = False
    for watch in watches.values():
        source = watch.source
        served |= source.sectors
        if watch.health(now) is Health.LIVE:
            usable = True
            watched |= source.sectors
            caps = np.where(source.sectors, np.maximum(caps, source.speed), caps)
        elif not complaint:
            complaint = watch.complaint(now)
    caps[~served] = profile.limits.unseen_speed
    closed = served & ~watched
    if closed.any():
        for _ in range(CLOSED_BESIDE):
            closed = closed | np.roll(closed, 1) | np.roll(closed, -1)
        caps[closed] = 0.0
    return np.minimum(caps, profile.limits.max_speed), ~served, usable, complaint
