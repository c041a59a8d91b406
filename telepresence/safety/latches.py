"""Stops that last until a person resets them: no robot restarts unasked after a bump or stop (ISO 3691-4, 4.1.14)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple


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

    Attributes:
        pressed: A bumper is pressed now.
        latched: Not yet reset.
        heading: Direction of the contact in the odometry frame [rad]; None if nothing is known about it.
    """

    pressed: bool = False
    latched: bool = False
    heading: float | None = None

    def press(self, heading: float | None) -> None:
        self.pressed = self.latched = True
        self.heading = heading

    def restore(self) -> None:
        """Take over the bump of a gate that has died; where it was is not known any more."""
        self.latched = True

    def turn(self, angle: float) -> None:
        """The odometry frame has been turned by `angle` [rad] around the robot."""
        if self.heading is not None:
            self.heading += angle

    def forget_heading(self) -> None:
        """The odometry frame is another one; where the contact was is not known any more."""
        self.heading = None

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
        """Return the direction of the contact in base_link for the robot's heading `theta`; None if unknown."""
        if self.heading is None:
            return None
        bearing = self.heading - theta
        return math.cos(bearing), math.sin(bearing)
