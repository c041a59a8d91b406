"""Decides which velocity may reach the wheels now. No clock, no thread, no robot: the time is an argument.

Silence counts as danger: a velocity holds for half a second, then the robot has to stop, whoever fell silent and why.
A value that is not a number stops the robot too, and so does a missing ROS master, because without one nobody new can
take over.
"""

from __future__ import annotations

import math
import threading
from typing import NamedTuple

COMMAND_TIMEOUT = 0.5
"""Seconds that a velocity command holds. The keyboard and the window repeat theirs every 0.1 s."""
STANDSTILL = 1e-3
"""Velocities below this [m/s, rad/s] count as zero, as they did in the driver this one replaces."""


class Velocity(NamedTuple):
    """Of base_footprint: forward and left [m/s], counter-clockwise [rad/s]."""

    vx: float
    vy: float
    wz: float

    @property
    def is_zero(self) -> bool:
        return all(abs(part) < STANDSTILL for part in self)


class Decision(NamedTuple):
    """What to do now. `velocity` None means stop; `fault` tells a stop that nobody commanded; `reason` is for
    people."""

    velocity: Velocity | None
    fault: bool
    reason: str


class CommandGate:
    """Holds the newest velocity command and says whether it still counts."""

    allows_goals = True
    """Whether a drive to a goal may begin and go on."""

    def __init__(self, timeout: float = COMMAND_TIMEOUT) -> None:
        self.timeout = timeout
        self.refused = 0
        """Commands that were not finite."""
        self._lock = threading.Lock()
        self._velocity: Velocity | None = None
        self._arrival = -math.inf
        self._refusal: str | None = None

    def command(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Take a command [m/s, m/s, rad/s] that arrived at `now` [s]; one that is not finite means stop."""
        velocity = Velocity(vx, vy, wz)
        bad = [f"{name} is {value}" for name, value in velocity._asdict().items() if not math.isfinite(value)]
        with self._lock:
            self._arrival = now
            if bad:
                self.refused += 1
                self._velocity = None
                self._refusal = f"command refused: {', '.join(bad)}"
            else:
                self._velocity = velocity
                self._refusal = None

    def clear(self) -> None:
        """Forget the command: the next one starts afresh."""
        with self._lock:
            self._velocity = None
            self._refusal = None
            self._arrival = -math.inf

    def decide(self, now: float, master_alive: bool = True) -> Decision:
        """What may happen at `now`; of several reasons to stop the first is given."""
        with self._lock:
            if not master_alive:
                return Decision(None, True, "stopped: the ROS master does not answer")
            if self._refusal is not None and now - self._arrival <= self.timeout:
                return Decision(None, True, f"stopped: {self._refusal}")
            if self._velocity is None:
                return Decision(None, False, "stopped: no command yet")
            if now - self._arrival > self.timeout:
                fault = not self._velocity.is_zero
                return Decision(None, fault, f"stopped: no command for {self.timeout:g} s" if fault else "stopped")
            if self._velocity.is_zero:
                return Decision(self._velocity, False, "stopped: the command is zero")
            return Decision(self._velocity, False, "driving")
