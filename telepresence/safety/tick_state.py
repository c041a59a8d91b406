"""What one tick knows: obstacles around the outline, and a speed limit for each direction."""

from __future__ import annotations

import functools
import math

import numpy as np

from .braking import VelocityBounds
from .known_obstacles import KnownObstacles
from .latches import BumperLatch
from .messages import SECTORS, in_words
from .obstacles import Obstacles
from .robot_profile import RobotProfile
from .timeouts import Health, SourceTimeout

_BEARINGS = np.arange(SECTORS) * math.tau / SECTORS
_UNIT = np.stack([np.cos(_BEARINGS), np.sin(_BEARINGS)])
"""Middle of each sector as columns (2, 72)."""
CLOSED_BESIDE = 6
"""Sectors to either side of a silent sensor's that are closed with it, because the robot is wide."""


class TickState:
    """The surroundings at one instant, in base_link.

    Attributes:
        now: [s].
        obstacles: Those near enough to limit the motion.
        caps: (72,) fastest driving that sensors and latches permit, obstacles aside [m/s].
        bumped: A sentence about a bump that is latched; empty if none is.
        usable: Whether some range source is live and none sends invalid values.
        complaint: A sentence about the first source that is not live; empty if all are.
    """

    def __init__(
        self,
        profile: RobotProfile,
        timeouts: dict[str, SourceTimeout],
        known_obstacles: KnownObstacles,
        bumper_latch: BumperLatch,
        now: float,
        theta: float,
    ) -> None:
        self._profile = profile
        self.now = now
        self.obstacles = Obstacles.around(profile, *known_obstacles.obstacles(now))
        for echo in known_obstacles.echoes():
            self.obstacles = self.obstacles.with_echo(echo, profile)
        self.caps, self._blind, self.usable, self.complaint = _sensor_caps(profile, timeouts, now)
        self.bumped = bumper_latch.message if bumper_latch.latched else ""
        if bumper_latch.latched:
            self.caps = np.minimum(self.caps, profile.limits.escape_speed)
            normal = bumper_latch.normal(theta)
            if normal is not None:
                self.obstacles = self.obstacles.with_contact(normal)

    def velocity_bounds(self, room: np.ndarray, turns: tuple[float, ...]) -> VelocityBounds:
        """Return the bounds that the obstacles put on the velocity; see `Obstacles.velocity_bounds`."""
        if room is self.obstacles.room and len(turns) == 1:
            return self._bounds
        return self.obstacles.velocity_bounds(self._profile.limits, self._profile.outline, room, turns)

    def allowed(self) -> np.ndarray:
        """Return the speed allowed straight into each sector (72,) [m/s]."""
        return self._allowed

    @functools.cached_property
    def _bounds(self) -> VelocityBounds:
        """The bounds for a robot that does not turn."""
        return self.obstacles.velocity_bounds(self._profile.limits, self._profile.outline, self.obstacles.room, (0.0,))

    @functools.cached_property
    def _walls(self) -> list[tuple[float, list[float]]]:
        """Room and normal of each obstacle. They are few: a loop takes a tenth of what NumPy's calls take."""
        return list(zip(self.obstacles.room.tolist(), self.obstacles.normals.tolist()))  # noqa: B905 Python 3.9

    @functools.cached_property
    def _allowed(self) -> np.ndarray:
        return np.minimum(self._bounds.speed_towards(_UNIT), self.caps)

    def why(self, sector: int) -> str:
        """Return the reason for the speed limit of a sector, as a sentence."""
        if self.complaint and not self._blind[sector]:
            return self.complaint if self.caps[sector] == 0.0 else f"{self.complaint} Slower without it."
        return "Slow: no sensor looks there." if self._blind[sector] else "Fastest that the sensors there are good for."

    def tightest(self, vx: float, vy: float) -> int | None:
        """Return the index of the obstacle that limits driving along (vx, vy) most; None if none is on that side."""
        speed = math.hypot(vx, vy)
        if speed == 0.0:
            return None
        tightest, least = None, math.inf
        for index, (room, (x, y)) in enumerate(self._walls):
            share = (x * vx + y * vy) / speed
            if share > 0.01 and (tightest is None or room / share < least):
                tightest, least = index, room / share
        return tightest

    def prepare(self) -> None:
        """Work out now what a command would have to wait for."""
        self._allowed, self._walls, self._bounds.nearest  # noqa: B018 they are kept

    def bearing(self, index: int) -> float:
        """Return the bearing of obstacle `index` [rad]."""
        x, y = self.obstacles.points[index]
        return math.atan2(y, x)

    def describe(self, index: int) -> str:
        """Return in words how far away obstacle `index` is, and where."""
        gap = max(0.0, float(self.obstacles.room[index]) + self._profile.limits.margin_beside)
        return f"{gap:.2f} m {in_words(self.bearing(index))}"


def _sensor_caps(
    profile: RobotProfile, timeouts: dict[str, SourceTimeout], now: float
) -> tuple[np.ndarray, np.ndarray, bool, str]:
    """Return the sectors' speed limits by sensor; which sectors none covers; whether any is usable; a complaint."""
    caps = np.zeros(SECTORS)
    served = np.zeros(SECTORS, bool)
    reporting = np.zeros(SECTORS, bool)
    complaint = ""
    usable = refused = False
    beams = np.zeros(SECTORS, bool)
    for timeout in timeouts.values():
        if not timeout.source.cone:
            beams |= timeout.source.sectors
    doubtful = min(profile.limits.unseen_speed, profile.limits.escape_speed)
    for timeout in timeouts.values():
        source = timeout.source
        served |= source.sectors
        health = timeout.health(now)
        if health is Health.LIVE:
            usable = True
            # A cone shows that something is there, hardly that nothing is: it does not replace beams.
            own = source.sectors & ~beams if source.cone else source.sectors
            seen = own & timeout.fresh_sectors(now)
            caps[own] = np.maximum(caps[own], doubtful)
            caps[seen] = np.maximum(caps[seen], source.speed)
            reporting |= own
        elif not complaint or health is Health.REFUSED:
            complaint = timeout.complaint(now)
        refused |= health is Health.REFUSED
    caps[~served] = profile.limits.unseen_speed
    closed = served & ~reporting
    if closed.any():
        for _ in range(CLOSED_BESIDE):
            closed = closed | np.roll(closed, 1) | np.roll(closed, -1)
        caps[closed] = 0.0
    return np.minimum(caps, profile.limits.max_speed), ~served, usable and not refused, complaint
