"""Who has been heard lately: the pilot's commands and every range source."""

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
"""Unchanged readings count as frozen only if the robot has moved this far meanwhile [m]."""


class CommandTimeout:
    """Keeps the newest valid command and lets it go when nothing follows.

    Commands are judged by their own stamp, so those that waited in a queue during a network stall are not obeyed later.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self.forget()

    def forget(self) -> None:
        self._command: Command | None = None
        self._heard = -math.inf
        self._newest = -math.inf
        self.problem = "No command yet."

    def offer(self, now: float, command: Command | None) -> bool:
        """Take in the newest command, which may be the one already known. False if it holds a non-finite value."""
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
            self._command, self._heard, self._newest = command, now, command.stamp
            self.problem = ""
        return True

    def current(self, now: float) -> Command | None:
        """The command to obey; None if there is none, `problem` then says why."""
        if self._command is not None and now - self._heard > self._limits.command_timeout:
            self.problem = f"No command for {now - self._heard:.1f} s."
            return None
        return self._command

    def age(self, now: float) -> float:
        """Age of the newest valid command by its stamp [s]."""
        return now - self._newest


class Health(Enum):
    """State of a range source, with what the pilot is told."""

    LIVE = "live"
    NEVER = "has not been heard yet"
    SILENT = "is silent"
    BLIND = "says of no beam what it sees"
    REFUSED = "sends values that can't be used"
    FROZEN = "repeats itself although the robot moves"


class SourceTimeout:
    """Judges one range source by its stamps and values."""

    def __init__(self, source: RangeSource, limits: Limits) -> None:
        self.source = source
        self._timeout = max(limits.sensor_timeout, 2.5 * source.period)
        self.forget()

    def forget(self) -> None:
        """Nothing heard yet."""
        self.newest = -math.inf
        self._refused = -math.inf
        self._frozen = False
        self._values = np.empty(0)
        self._since = -math.inf
        self._moved_then = 0.0
        self._known_at = np.full(self.source.beams, -math.inf)

    def accept(self, now: float, stamp: float, scan: Scan | None) -> bool:
        """True if the scan is news and can be used."""
        if scan is None or not math.isfinite(stamp) or stamp > now + AHEAD_OF_TIME:
            self._refused = now
            return False
        if stamp <= self.newest:
            return False
        self._refused = -math.inf
        self.newest = stamp
        self._known_at[scan.known] = stamp
        return True

    def watched(self, now: float) -> np.ndarray:
        """(72,) sectors in which some beam has said something lately."""
        fresh = now - self._known_at <= self._timeout
        return self.source.sectors if fresh.all() else np.any(self.source.serves[:, fresh], axis=1)

    def compare(self, stamp: float, scan: Scan, moved: float) -> None:
        """Look whether anything changes while the robot moves.

        Args:
            moved: How far the robot has moved in its life, turning included [m].
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
        """What is wrong, as a sentence."""
        health = self.health(now)
        lasting = f" for {now - self.newest:.1f} s" if health is Health.SILENT else ""
        return f"The {self.source.name} {health.value}{lasting}."
