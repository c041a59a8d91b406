"""Timeouts of the pilot's commands and of every range source."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np

from .messages import Command
from .robot_profile import Limits, RangeSource
from .scan import Scan

AHEAD_OF_TIME = 0.1
"""A stamp may be this far in the future, for clocks that differ a little [s]."""
MOVED = 0.05
"""Unchanged readings count as frozen only after the robot has moved this far [m]."""


class CommandTimeout:
    """Keeps the newest valid command until it times out.

    Commands are judged by their own stamp, so one that waited in a queue during a network stall is not obeyed later.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.forget()

    def forget(self) -> None:
        self._command: Command | None = None
        self._received = -math.inf
        self._newest = -math.inf
        self.problem = "No command yet."

    def offer(self, now: float, command: Command | None) -> bool:
        """Take the newest command, which may be the one already known. False if it contains a non-finite value."""
        if command is None:
            return True
        if not command.finite:
            self._command = None
            self.problem = "The command holds a value that is not a number."
            return False
        if command.stamp <= self._newest:
            return True
        if command.stamp > now + AHEAD_OF_TIME:
            self.problem = f"Commands are stamped {command.stamp - now:.1f} s in the future: the clocks differ."
        elif now - command.stamp > self._limits.command_max_age:
            self.problem = f"Commands arrive {now - command.stamp:.1f} s late."
        else:
            self._command, self._received, self._newest = command, now, command.stamp
            self.problem = ""
        return True

    def current(self, now: float) -> Command | None:
        """Return the command to obey; None if there is none, and `problem` says why."""
        if self._command is not None and now - self._received > self._limits.command_timeout:
            self.problem = f"No command for {now - self._received:.1f} s."
            return None
        return self._command

    def age(self, now: float) -> float:
        """Return the age of the newest valid command by its stamp [s]."""
        return now - self._newest


class BumperTimeout:
    """Judges by its age whether the bumper is heard.

    Args:
        timeout: Silence for longer than this is a fault [s]; None for a bumper that nobody has to hear.
    """

    def __init__(self, timeout: float | None) -> None:
        self._timeout = timeout
        self.forget()

    def forget(self) -> None:
        """Start again, as if the bumper had said nothing yet."""
        self._newest = -math.inf

    def accept(self, now: float) -> None:
        self._newest = now

    def complaint(self, now: float) -> str:
        """Return what is wrong, as a sentence; empty if nothing is."""
        if self._timeout is None or now - self._newest <= self._timeout:
            return ""
        if self._newest == -math.inf:
            return f"The bumper {Health.NEVER.value}."
        return f"The bumper {Health.SILENT.value} for {now - self._newest:.1f} s."


class Health(Enum):
    """State of a range source; the value completes a sentence for the pilot, "The infrared ..."."""

    LIVE = "live"
    NEVER = "has sent nothing yet"
    SILENT = "is silent"
    BLIND = "has no valid reading"
    REFUSED = "sends values that can't be used"
    FROZEN = "repeats itself although the robot moves"


class SourceTimeout:
    """Judges the health of one range source by its stamps and values."""

    def __init__(self, source: RangeSource, limits: Limits) -> None:
        self.source = source
        self._timeout = max(limits.sensor_timeout, 2.5 * source.period)
        self.forget()

    def forget(self) -> None:
        """Start again, as if no reading had arrived yet."""
        self.newest = -math.inf
        self._refused = -math.inf
        self._frozen = False
        self._values = np.empty(0)
        self._since = -math.inf
        self._moved_then = 0.0
        self._known_at = np.full(self.source.beams, -math.inf)

    def accept(self, now: float, stamp: float, scan: Scan | None) -> bool:
        """Take a scan; True if it is newer than the last and valid."""
        if scan is None or not math.isfinite(stamp) or stamp > now + AHEAD_OF_TIME:
            self._refused = now
            return False
        if stamp <= self.newest:
            return False
        self._refused = -math.inf
        self.newest = stamp
        self._known_at[scan.known] = stamp
        return True

    def fresh_sectors(self, now: float) -> np.ndarray:
        """Return the sectors (72,) in which some beam has had a reading lately."""
        fresh = now - self._known_at <= self._timeout
        return self.source.sectors if fresh.all() else np.any(self.source.serves[:, fresh], axis=1)

    def check_frozen(self, stamp: float, scan: Scan, moved: float) -> None:
        """Check whether readings change while the robot moves.

        Args:
            moved: Path length so far, turning included [m].
        """
        returns = np.isfinite(scan.ranges)
        if not returns.any() or not np.array_equal(scan.ranges, self._values):
            self._values, self._since, self._moved_then = scan.ranges, stamp, moved
            self._frozen = False
            return
        self._frozen = stamp - self._since > self.source.frozen_after and moved - self._moved_then > MOVED

    def health(self, now: float) -> Health:
        if now - self._refused <= self._timeout:
            return Health.REFUSED
        if self.newest == -math.inf:
            return Health.NEVER
        if now - self.newest > self._timeout:
            return Health.SILENT
        if now - self._known_at.max() > self._timeout:
            return Health.BLIND
        return Health.FROZEN if self._frozen else Health.LIVE

    def complaint(self, now: float) -> str:
        """Return what is wrong, as a sentence."""
        health = self.health(now)
        lasting = f" for {now - self.newest:.1f} s" if health is Health.SILENT else ""
        return f"The {self.source.name} {health.value}{lasting}."
