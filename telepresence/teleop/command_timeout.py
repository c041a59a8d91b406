"""How long a velocity command counts, the same for every driver. No clock, no robot: the time is an argument.

Silence counts as danger: a command holds for half a second, whoever fell silent and why. A value that is not finite
stops the robot too, and so does a ROS master that does not answer, because without one nobody new can take over.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from enum import Enum, auto
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY, Velocity

DRIVER_TIMEOUT = 0.5
"""Seconds for which a velocity command is valid. Window and page repeat theirs every `SEND_PERIOD`, keyboard nodes
every 0.1 s."""
SEND_PERIOD = 0.05
"""Seconds between two commands of window and page while something is held: velocities, and looks of the head."""
ZEROS_TIME = 0.3
"""Seconds for which zeros are sent after driving; then nothing, so that others may drive."""


class CommandState(Enum):
    """What the newest command is worth now."""

    NONE = auto()
    """No command has come yet."""
    DRIVING = auto()
    ZERO = auto()
    """The last command is young and zero."""
    REFUSED = auto()
    """The last command is young and not finite."""
    OVER = auto()
    """The last command is old and was zero: nothing is wrong."""
    SILENT = auto()
    """The last command is old and was not zero."""
    NO_MASTER = auto()
    """The ROS master does not answer, whatever was commanded."""


class CheckedCommand(NamedTuple):
    """The newest command at one moment.

    Args:
        velocity: What to drive; zero unless `state` is DRIVING or ZERO.
        state: Why.
        reason: The same for people: "driving" or "stopped: ...".
    """

    velocity: Velocity
    state: CommandState
    reason: str

    @property
    def counts(self) -> bool:
        """Whether somebody commands this velocity now; else it is zero for want of a command."""
        return self.state in (CommandState.DRIVING, CommandState.ZERO)


class LatestCommand:
    """The newest velocity command, and whether it still counts. Commands may come from another thread.

    Args:
        timeout: How long a command holds [s].
        standstill: Velocities whose parts are all smaller count as zero [m/s, rad/s].
        limit: What the robot makes of a finite command, for example its top speed.
    """

    def __init__(
        self,
        timeout: float = DRIVER_TIMEOUT,
        standstill: float = 0.0,
        limit: Callable[[Velocity], Velocity] = lambda velocity: velocity,
    ) -> None:
        self.timeout = timeout
        self.refused = 0
        """Commands that were not finite."""
        self._standstill = standstill
        self._limit = limit
        self._lock = threading.Lock()
        self._velocity = ZERO_VELOCITY
        self._arrival = -math.inf
        self._refusal = ""

    def put(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Take a command [m/s, m/s, rad/s] that arrived at `now` [s]; one that is not finite means stop."""
        velocity = Velocity(vx, vy, wz)
        bad = []
        if not all(map(math.isfinite, velocity)):
            bad = [f"{name} is {value}" for name, value in velocity._asdict().items() if not math.isfinite(value)]
        with self._lock:
            self._arrival = now
            self._refusal = f"command refused: {', '.join(bad)}" if bad else ""
            self.refused += bool(bad)
            self._velocity = ZERO_VELOCITY if bad else self._limit(velocity)

    def clear(self) -> None:
        """Forget the command, as if none had come."""
        with self._lock:
            self._velocity, self._refusal, self._arrival = ZERO_VELOCITY, "", -math.inf

    def check(self, now: float, master_alive: bool = True) -> CheckedCommand:
        """What the command is worth at `now` [s]; of several reasons to stop the first is given."""
        with self._lock:
            state, why = self._judge(now, master_alive)
            if state is CommandState.DRIVING:
                return CheckedCommand(self._velocity, state, "driving")
            velocity = self._velocity if state is CommandState.ZERO else ZERO_VELOCITY
            return CheckedCommand(velocity, state, f"stopped: {why}" if why else "stopped")

    def _judge(self, now: float, master_alive: bool) -> tuple[CommandState, str]:
        if not master_alive:
            return CommandState.NO_MASTER, "the ROS master does not answer"
        if self._arrival == -math.inf:
            return CommandState.NONE, "no command yet"
        size = max(map(abs, self._velocity))
        zero = size == 0.0 or size < self._standstill
        if now - self._arrival > self.timeout:
            return (CommandState.OVER, "") if zero else (CommandState.SILENT, f"no command for {self.timeout:g} s")
        if self._refusal:
            return CommandState.REFUSED, self._refusal
        return (CommandState.ZERO, "the command is zero") if zero else (CommandState.DRIVING, "")
