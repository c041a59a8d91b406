"""Between the pilot's velocity and Pepper's wheels: the command watchdog, and behind it the safety gate.

No clock, no robot: times are arguments, on one monotonic clock. Goals (`moveTo`) are left to NAOqi's own protection,
but a stop and a bump end them too.
"""

from __future__ import annotations

import cmath
import math
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from naoqi_driver.command_watchdog import CommandWatchdog, WheelCommand, is_zero
from naoqi_driver.range_sensors import Reading
from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.safety import PEPPER, Command, Decision, Latched, Odometry, State, VelocityGate
from telepresence.safety.robot_profile import DRIVER_COMMAND_TIMEOUT

PROFILE = replace(PEPPER, limits=replace(PEPPER.limits, command_timeout=DRIVER_COMMAND_TIMEOUT))
"""What the gate here knows."""
BRAKE = (State.STOPPED, State.FAULT, State.SENSOR_STALE, State.BUMPED, State.NO_COMMAND)
"""A zero for these reasons ends the motion as fast as the robot can; other zeros follow the gate's own braking law."""


class GatedDrive:
    """A `CommandWatchdog` whose output passes through the safety gate.

    One thread at a time calls `decide`. All else may be called on other threads, and never waits for the robot.

    Args:
        on_bump: Called when a bumper was hit, on the thread that says so.
    """

    def __init__(self, on_bump: Callable[[], None] = lambda: None) -> None:
        self._on_bump = on_bump
        self.decision: Decision | None = None
        """The safety gate's last word."""
        self._commands = CommandWatchdog()
        self._gate = VelocityGate(PROFILE)
        self._lock = threading.Lock()  # protects the gate
        self._command: Command | None = None
        self._odometry: Odometry | None = None
        self._pressed: tuple[float, ...] = ()

    @property
    def allows_goals(self) -> bool:
        """Like `CommandWatchdog.allows_goals`, but false while a stop or a bump is latched."""
        return self._gate.latched == Latched()

    @property
    def latched(self) -> Latched:
        """What a person has to reset."""
        with self._lock:
            return self._gate.latched

    @property
    def refused(self) -> int:
        """Commands that were not finite."""
        return self._commands.refused

    def command(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Do the same as `CommandWatchdog.command`."""
        self._commands.command(vx, vy, wz, now)
        self._command = Command(vx, vy, wz, now)

    def clear(self) -> None:
        """Do the same as `CommandWatchdog.clear`."""
        self._commands.clear()

    def receive(self, reading: Reading, now: float) -> None:
        """Take what the robot has measured; it counts from the next decision on, which does not wait for this work."""
        with self._lock:
            before = self._gate.latched
            self._take(reading, now)
            bumped = self._gate.latched != before
        if bumped:
            self._on_bump()

    def restore(self, latched: Latched) -> None:
        """Take over what was latched in a driver that has died."""
        with self._lock:
            self._gate.restore(latched)

    def stop(self, reason: str) -> None:
        """Stop, goals too, and stay stopped until `reset_stop`. `reason` completes "stopped: ..."."""
        with self._lock:
            self._gate.stop(reason)

    def reset_stop(self) -> None:
        """Reset the stop; the controls must be let go of once before the robot moves again."""
        with self._lock:
            self._gate.reset_stop()

    def reset_bumper(self) -> bool:
        """Reset the bumper. False while a bumper is still pressed."""
        with self._lock:
            return self._gate.reset_bumper()

    def obstacles(self) -> np.ndarray:
        """Places of known obstacles in base_footprint, (n, 2) [m]."""
        with self._lock:
            return self._gate.obstacles()

    def decide(self, now: float, master_alive: bool = True) -> WheelCommand:
        """What may happen at `now` [s]; call it at least 20 times a second."""
        with self._lock:
            self.decision = self._gate.step(now, self._command, self._odometry)
            latched = self._gate.latched
        return judge(self._commands.decide(now, master_alive), self.decision, latched)

    def _take(self, reading: Reading, now: float) -> None:
        self._odometry = reading.odometry
        for name, points in reading.points.items():
            self._gate.update_range_points(name, now, points.tolist(), reading.odometry.stamp)
        for name, distance in reading.ranges.items():
            self._gate.update_ranges(name, now, [distance], reading.odometry.stamp)
        if set(reading.pressed) - set(self._pressed):
            # The latch has one direction; that between two bumpers keeps the robot from both.
            middle = sum(cmath.rect(1.0, bearing) for bearing in reading.pressed)
            self._gate.update_bumper(now, True, cmath.phase(middle))
        if self._pressed and not reading.pressed:
            self._gate.update_bumper(now, False)
        self._pressed = reading.pressed
        self._gate.precompute(now, self._odometry)


def judge(wanted: WheelCommand, allowed: Decision, latched: Latched) -> WheelCommand:
    """Return what the wheels get after both have decided.

    Args:
        wanted: By the command watchdog.
        allowed: By the safety gate.
        latched: What a person has to reset.
    """
    if latched.stopped:
        return WheelCommand(None, True, f"stopped: {latched.stopped}; reset_stop resets it")
    if wanted.velocity is None or is_zero(wanted.velocity):
        if not latched.bumped:
            return wanted
        reason = f"{wanted.reason}; a bumper was hit, reset_bumper resets it"
        return wanted._replace(fault=True, reason=reason)
    velocity = Velocity(allowed.vx, allowed.vy, allowed.wz)
    if not all(map(math.isfinite, velocity)):  # never seen; but it would drive a robot
        return WheelCommand(None, True, "stopped: the safety gate gave no number")
    if not is_zero(velocity):
        slower = "" if allowed.state is State.CLEAR else f": {_as_clause(allowed.reason)}"
        return WheelCommand(velocity, False, f"driving{slower}")
    reason = f"stopped: {_as_clause(allowed.reason)}"
    if allowed.state in BRAKE:
        return WheelCommand(None, True, reason)
    return WheelCommand(ZERO_VELOCITY, False, reason)


def _as_clause(sentence: str) -> str:
    """A sentence as it goes on after a colon."""
    return sentence[:1].lower() + sentence[1:].rstrip(".")
