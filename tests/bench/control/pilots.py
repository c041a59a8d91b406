"""Two ways to drive a given path: by the clock, and by odometry. Velocities in base_link, one decision per period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

PERIOD = 0.05
"""[s]"""
PAUSE = 0.6
"""Between two legs, so that the robot stands before it turns [s]."""
ALMOST = 0.004
"""A leg is over this close to its end [m]."""
ALIGNED = 0.012
"""A turn is over this close to its end [rad]."""
GIVE_UP = 3.0
"""The pilot stops after this long without progress [s]."""

Velocity = tuple[float, float, float]
Pose = tuple[float, float, float]
STANDING: Velocity = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Leg:
    """Go straight on by `distance` [m], or turn by `turn` [rad], counter-clockwise."""

    distance: float = 0.0
    turn: float = 0.0


class Pilot(Protocol):
    def decide(self, now: float, odometry: Pose) -> Velocity | None:
        """What to send; None when the path is done or given up."""


class ByTheClock:
    """Open loop: each leg takes its length divided by the speed."""

    def __init__(self, path: tuple[Leg, ...], speed: float, turn: float) -> None:
        self._timetable: list[tuple[float, Velocity]] = []
        at = 0.0
        for leg in path:
            if leg.distance:
                at += leg.distance / speed
                velocity = (speed, 0.0, 0.0)
            else:
                at += abs(leg.turn) / turn
                velocity = (0.0, 0.0, math.copysign(turn, leg.turn))
            self._timetable.append((at, velocity))
            at += PAUSE
            self._timetable.append((at, STANDING))

    def decide(self, now: float, odometry: Pose) -> Velocity | None:
        return next((velocity for until, velocity in self._timetable if now < until - 1e-9), None)


class ByOdometry:
    """Feedback: steers back to the line of the leg, slows down towards its end, and turns to the wanted heading."""

    def __init__(self, path: tuple[Leg, ...], speed: float, turn: float) -> None:
        self._speed, self._turn = speed, turn
        self._goals: list[tuple[float, float, float, bool]] = []
        x = y = heading = 0.0
        for leg in path:
            heading += leg.turn
            x, y = x + leg.distance * math.cos(heading), y + leg.distance * math.sin(heading)
            self._goals.append((x, y, heading, bool(leg.distance)))
        self._pause_until = -1.0
        self._best, self._since = math.inf, 0.0

    def decide(self, now: float, odometry: Pose) -> Velocity | None:
        if now < self._pause_until:
            return STANDING
        if not self._goals:
            return None
        x, y, heading, straight = self._goals[0]
        off = math.remainder(heading - odometry[2], math.tau)
        if straight:
            dx, dy = x - odometry[0], y - odometry[1]
            left = dx * math.cos(heading) + dy * math.sin(heading)
            aside = dy * math.cos(heading) - dx * math.sin(heading)
            done = left < ALMOST
            velocity = (
                min(self._speed, max(1.2 * left, 0.12 * self._speed)),
                0.0,
                _clip(1.5 * off + 3.0 * _clip(aside, 0.1), self._turn),
            )
        else:
            left = abs(off)
            done = left < ALIGNED
            velocity = (0.0, 0.0, math.copysign(min(self._turn, max(1.5 * left, 0.06)), off))
        if left < self._best - 0.005:
            self._best, self._since = left, now
        if done or now - self._since > GIVE_UP:
            if not done:
                self._goals.clear()
            else:
                self._goals.pop(0)
            self._pause_until = now + PAUSE
            self._best, self._since = math.inf, now + PAUSE
            return STANDING
        return velocity


def _clip(value: float, size: float) -> float:
    return max(-size, min(size, value))
