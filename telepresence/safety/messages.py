"""What goes into the gate and what comes out: command, odometry, decision."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

import numpy as np

SECTORS = 72
"""Directions for which an allowed speed is published; sector k is centred on k * 5 degrees, counter-clockwise."""


class Command(NamedTuple):
    """The velocity that the pilot requests, in base_link.

    Args:
        vx, vy: Forward and left [m/s].
        wz: Counter-clockwise [rad/s].
        stamp: When it was given, on the gate's clock [s].
    """

    vx: float
    vy: float
    wz: float
    stamp: float

    @property
    def finite(self) -> bool:
        return all(map(math.isfinite, self))


class Odometry(NamedTuple):
    """Pose of base_link in the odometry frame (x, y [m], theta [rad]) at `stamp` [s] on the gate's clock."""

    x: float
    y: float
    theta: float
    stamp: float

    @property
    def finite(self) -> bool:
        return all(map(math.isfinite, self))


class State(str, Enum):
    """Why the output is what it is, worst first."""

    STOPPED = "stopped"
    """Latched by `stop()`, until `reset_stop()` is called and the controls are let go of."""
    FAULT = "fault"
    """A value that can't be used: not finite, odometry missing or old, clock jumped."""
    SENSOR_STALE = "sensor stale"
    """A range sensor that this motion needs is silent, frozen or refused."""
    BUMPED = "bumped"
    """A bumper was hit; only away from it, slowly, until `reset_bumper()`."""
    NO_COMMAND = "no command"
    """No valid command has arrived lately."""
    BLOCKED = "blocked"
    """Obstacles allow none of the requested motion."""
    LIMITED = "limited"
    """Part of the command is cut."""
    CLEAR = "clear"
    """The command passes."""


@dataclass(frozen=True, eq=False)
class Decision:
    """The velocity that may reach the wheels now, and why.

    Args:
        vx, vy, wz: In base_link [m/s, m/s, rad/s].
        state: The worst one that applies.
        reason: One sentence for the pilot.
        allowed: (72,) speed that would be allowed straight into each sector [m/s].
        gap: Distance from the outline to the nearest known obstacle [m]; infinity if none.
        sector: Sector of the obstacle that limits the motion most; None if none does.
        command_age: Age of the newest valid command by its stamp [s]; infinity if none.
        scanning: The gate itself is swinging the body (careful mode).
        swing: How far that has turned the body away from the pilot's heading [rad].
    """

    vx: float
    vy: float
    wz: float
    state: State
    reason: str
    allowed: np.ndarray = field(default_factory=lambda: np.zeros(SECTORS))
    gap: float = math.inf
    sector: int | None = None
    command_age: float = math.inf
    scanning: bool = False
    swing: float = 0.0

    @property
    def speed(self) -> float:
        return math.hypot(self.vx, self.vy)


def sector_of(bearing: float) -> int:
    """Return the sector that contains a bearing [rad]."""
    return round(bearing / math.tau * SECTORS) % SECTORS


def in_words(bearing: float) -> str:
    """Return a bearing [rad] in words."""
    names = ("ahead", "ahead left", "left", "behind left", "behind", "behind right", "right", "ahead right")
    return names[round(bearing / math.tau * 8) % 8]
