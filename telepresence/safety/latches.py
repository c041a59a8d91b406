"""Stops that last until a person resets them: no robot restarts unasked after a bump or stop (ISO 3691-4, 4.1.14)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

TRIED = 0.03
"""How far a pilot may drive with a bumper pressed to find out where it is free [m]: farther than any bumper gives."""


class Latched(NamedTuple):
    """What holds until a person resets it: why the robot is stopped (empty: it is not), whether a bumper was hit."""

    stopped: str = ""
    bumped: bool = False


class StopLatch:
    """A stop by the pilot or the system. After its reset the controls must be let go of once before anything moves."""

    def __init__(self) -> None:
        self.reason = ""
        self._waiting = False

    @property
    def holds(self) -> bool:
        return bool(self.reason) or self._waiting

    @property
    def message(self) -> str:
        if self.reason:
            return f"Stopped: {self.reason}. Reset to go on."
        return "The stop is reset. Let go of the controls once to drive again."

    def set(self, reason: str) -> None:
        self.reason = reason or "stop pressed"

    def reset(self) -> None:
        self._waiting = self._waiting or bool(self.reason)
        self.reason = ""

    def update(self, asks_for_motion: bool) -> None:
        """Take what the pilot commands now; call it every tick."""
        if not asks_for_motion and not self.reason:
            self._waiting = False


@dataclass
class BumperLatch:
    """A bump: until it is reset only slow motion away from it is allowed.

    Where nothing is known about the contact (bumped while standing, or in a gate that has died since), the pilot tries:
    a way that has led farther than `TRIED` from where the bumper was pressed, and has not released it, goes no farther.

    Attributes:
        pressed: A bumper is pressed now.
        latched: Not yet reset.
        heading: Direction of the contact in the odometry frame [rad]; None if nothing is known about it.
    """

    pressed: bool = False
    latched: bool = False
    heading: float | None = None
    _begin: tuple[float, float] | None = None
    _way: tuple[float, float] = (0.0, 0.0)

    @property
    def message(self) -> str:
        """A sentence for the pilot while it is latched."""
        if self.heading is not None:
            return "A bumper was hit: only away from it, slowly, until it is reset."
        if self.pressed:
            return f"A bumper was hit, where is not known: slowly, {100 * TRIED:.0f} cm at most unless that frees it."
        return "A bumper was hit, where is not known: slowly, until it is reset."

    def press(self, heading: float | None) -> None:
        self.pressed = self.latched = True
        self.heading = heading
        self._stay()

    def restore(self) -> None:
        """Take over the bump of a gate that has died; where it was is not known any more."""
        self.latched = True

    def move(self, x: float, y: float) -> None:
        """Take the robot's place in the odometry frame [m]; call it for every pose."""
        self._begin = self._begin or (x, y)
        self._way = x - self._begin[0], y - self._begin[1]

    def turn(self, angle: float) -> None:
        """The odometry frame has been turned by `angle` [rad] around the robot."""
        if self.heading is not None:
            self.heading += angle
        self._stay()

    def forget_heading(self) -> None:
        """The odometry frame is another one; where the contact was is not known any more."""
        self.heading = None
        self._stay()

    def release(self) -> None:
        self.pressed = False

    def reset(self) -> bool:
        """Reset the latch. False, and still latched, while a bumper is pressed."""
        if self.pressed:
            return False
        self.latched = False
        self.heading = None
        return True

    def normal(self, theta: float) -> tuple[float, float] | None:
        """Return the direction in base_link, for the robot's heading `theta`, into which nothing may drive: that of the
        contact, or of a way that did not release the bumper. None if there is none."""
        heading = self.heading
        if heading is None and self.pressed and math.hypot(*self._way) >= TRIED:
            heading = math.atan2(self._way[1], self._way[0])
        if heading is None:
            return None
        return math.cos(heading - theta), math.sin(heading - theta)

    def _stay(self) -> None:
        """Count the way from here on."""
        self._begin, self._way = None, (0.0, 0.0)
