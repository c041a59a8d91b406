"""Decides which velocity goes to the robot now. No clock, no thread, no robot: the time is an argument.

Silence counts as danger: a velocity holds for half a second. A value that is not a number, or a ROS master that does
not answer, stops the robot too. After a stop zeros are sent for a moment, and then nothing, so that others may drive.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import NamedTuple

COMMAND_TIMEOUT = 0.5
"""Seconds that a velocity command holds."""
ZEROS_TIME = 0.3
"""Seconds for which zeros are sent after the last command."""


@dataclass(frozen=True)
class SpeedLimits:
    """Of the driver; the names are those of the old nodes.

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
        vx, vy = (_raised(part, self.min_linear) for part in velocity[:2])
        size = math.hypot(vx, vy)
        scale = self.max_linear / size if size > self.max_linear else 1.0
        wz = max(-self.max_angular, min(self.max_angular, _raised(velocity.wz, self.min_angular)))
        return Velocity(vx * scale, vy * scale, wz)


class Velocity(NamedTuple):
    """Of base_link: forward and left [m/s], counter-clockwise [rad/s]."""

    vx: float
    vy: float
    wz: float


ZERO = Velocity(0.0, 0.0, 0.0)


class Decision(NamedTuple):
    """`velocity` is what to send now, None for nothing; `reason` is for people."""

    velocity: Velocity | None
    reason: str


class CommandGate:
    """Holds the newest velocity command and says whether it still counts. Commands may come from another thread."""

    def __init__(self, limits: SpeedLimits | None = None, timeout: float = COMMAND_TIMEOUT) -> None:
        self.refused = 0
        """Commands that were not finite."""
        self._limits = limits or SpeedLimits()
        self._timeout = timeout
        self._lock = threading.Lock()
        self._velocity = ZERO
        self._refusal = ""
        self._arrival = -math.inf
        self._stopped_at = -math.inf

    def command(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Take a command that arrived at `now` [s]; one that is not finite means stop."""
        velocity = Velocity(vx, vy, wz)
        bad = [f"{name} is {value}" for name, value in velocity._asdict().items() if not math.isfinite(value)]
        with self._lock:
            self._arrival = now
            self._refusal = f"command refused: {', '.join(bad)}" if bad else ""
            self.refused += bool(bad)
            self._velocity = ZERO if bad else self._limits.apply(velocity)

    def decide(self, now: float, master_alive: bool = True) -> Decision:
        """What to send at `now` [s]."""
        with self._lock:
            silent = now - self._arrival > self._timeout
            if master_alive and not silent:
                self._stopped_at = now
                if self._velocity != ZERO:
                    return Decision(self._velocity, "driving")
                return Decision(ZERO, f"stopped: {self._refusal or 'the command is zero'}")
            reason = self._why(silent)
            return Decision(ZERO if now - self._stopped_at <= ZEROS_TIME else None, reason)

    def _why(self, silent: bool) -> str:
        if not silent:
            return "stopped: the ROS master does not answer"
        if self._arrival == -math.inf:
            return "stopped: no command yet"
        return f"stopped: no command for {self._timeout:g} s" if self._velocity != ZERO else "stopped"


def _raised(value: float, least: float) -> float:
    return math.copysign(least, value) if 0.0 < abs(value) < least else value
