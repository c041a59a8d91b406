"""Decides which velocity may reach Pepper's wheels now. No clock, no thread, no robot: the time is an argument.

How long a command counts is `telepresence.teleop.command_timeout`; what a stop is on Pepper is decided here.
"""

from __future__ import annotations

from typing import NamedTuple

from telepresence.geometry import Velocity
from telepresence.teleop.command_timeout import DRIVER_TIMEOUT, CommandState, LatestCommand

STANDSTILL = 1e-3
"""Velocities below this [m/s, rad/s] count as zero, as they did in the driver this one replaces."""
FAULTS = (CommandState.NO_MASTER, CommandState.REFUSED, CommandState.SILENT)
"""Stops that nobody commanded."""


class WheelCommand(NamedTuple):
    """What to do now.

    Args:
        velocity: In base_footprint; None means stop.
        fault: Nobody commanded this stop.
        reason: For people.
    """

    velocity: Velocity | None
    fault: bool
    reason: str


class CommandWatchdog:
    """Holds the newest velocity command and says whether it still counts."""

    allows_goals = True
    """Whether a drive to a goal may begin and go on."""

    def __init__(self, timeout: float = DRIVER_TIMEOUT) -> None:
        self._latest = LatestCommand(timeout, STANDSTILL)

    @property
    def timeout(self) -> float:
        """How long a command holds [s]."""
        return self._latest.timeout

    @property
    def refused(self) -> int:
        """Commands that were not finite."""
        return self._latest.refused

    def command(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Take a command [m/s, m/s, rad/s] that arrived at `now` [s]; one that is not finite means stop."""
        self._latest.put(vx, vy, wz, now)

    def clear(self) -> None:
        """Forget the command: the next one starts afresh."""
        self._latest.clear()

    def decide(self, now: float, master_alive: bool = True) -> WheelCommand:
        """What may happen at `now`; of several reasons to stop the first is given."""
        checked = self._latest.check(now, master_alive)
        return WheelCommand(checked.velocity if checked.counts else None, checked.state in FAULTS, checked.reason)


def is_zero(velocity: Velocity) -> bool:
    """Whether the velocity counts as zero."""
    return max(map(abs, velocity)) < STANDSTILL
