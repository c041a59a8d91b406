"""Decides which velocity goes to Robotino now. No clock, no thread, no robot: the time is an argument.

How long a command counts is `telepresence.teleop.command_timeout`. Here the robot's limits are added, and that after a
stop zeros are sent for a moment, and then nothing, so that others may drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.command_timeout import DRIVER_TIMEOUT, ZEROS_TIME, CommandState, LatestCommand


@dataclass(frozen=True)
class SpeedLimits:
    """Limits of the driver; the names are those of the old nodes.

    Args:
        max_linear: Larger velocities are shortened to this, in their direction [m/s].
        max_angular: Faster turning is cut to this [rad/s].
        min_linear, min_angular: Smaller velocities but zero are raised to this, each axis on its own, as the old nodes
            did. 0 is off, and should be: it makes a careful creep fast.
    Raises:
        ValueError: A limit is negative, or a smallest one above its largest.
    """

    max_linear: float = 0.5
    max_angular: float = 1.0
    min_linear: float = 0.0
    min_angular: float = 0.0

    def __post_init__(self) -> None:
        for least, most, name in (
            (self.min_linear, self.max_linear, "linear"),
            (self.min_angular, self.max_angular, "angular"),
        ):
            if not 0.0 <= least <= most < math.inf:
                raise ValueError(f"min_{name}_vel {least} and max_{name}_vel {most} leave no speed between them")

    def apply(self, velocity: Velocity) -> Velocity:
        """Return the velocity within the limits."""
        vx, vy = (_raised(part, self.min_linear) for part in velocity[:2])
        size = math.hypot(vx, vy)
        scale = self.max_linear / size if size > self.max_linear else 1.0
        wz = max(-self.max_angular, min(self.max_angular, _raised(velocity.wz, self.min_angular)))
        return Velocity(vx * scale, vy * scale, wz)


class WheelCommand(NamedTuple):
    """`velocity` is what to send now, in base_link, None for nothing; `reason` is for people."""

    velocity: Velocity | None
    reason: str


class CommandWatchdog:
    """Holds the newest velocity command and says whether it still counts. Commands may come from another thread."""

    def __init__(self, limits: SpeedLimits | None = None, timeout: float = DRIVER_TIMEOUT) -> None:
        self._latest = LatestCommand(timeout, limit=(limits or SpeedLimits()).apply)
        self._stopped_at = -math.inf

    @property
    def refused(self) -> int:
        """Commands that were not finite."""
        return self._latest.refused

    def command(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Take a command [m/s, m/s, rad/s] that arrived at `now` [s]; one that is not finite means stop."""
        self._latest.put(vx, vy, wz, now)

    def decide(self, now: float, master_alive: bool = True) -> WheelCommand:
        """What to send at `now` [s]; for the one thread that sends."""
        checked = self._latest.check(now, master_alive)
        if checked.counts or checked.state is CommandState.REFUSED:
            self._stopped_at = now
            return WheelCommand(checked.velocity, checked.reason)
        return WheelCommand(ZERO_VELOCITY if now - self._stopped_at <= ZEROS_TIME else None, checked.reason)


def _raised(value: float, least: float) -> float:
    return math.copysign(least, value) if 0.0 < abs(value) < least else value
