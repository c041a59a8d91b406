"""The two safety gates behind one interface: velocities and readings in, the robot's velocity out. No ROS, no clock.

`RobotGate` is the project's gate (telepresence.safety), asked at a fixed rate. `BubbleGate` is the filter of the
Robotino guide exactly: it acts when a command comes, and only then. The guide's weaknesses come with it; it is here to
be compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from rto_safe_teleop.bubble import Bubble, ClampLimits, points_of_ranges
from telepresence.safety import ROBOTINO, SECTORS, Command, Decision, Odometry, State, VelocityGate
from telepresence.safety.robot_profile import DRIVER_COMMAND_TIMEOUT

SAFETY_RADIUS = 0.4
"""The bubble's, from the robot's middle [m]: gulbasozan/robotino-ros2, parameter safety_radius."""
SILENT_AFTER = 0.5
"""The gate sends zeros for this long after the last command, then nothing, so that others may drive [s]."""

PROFILE = replace(ROBOTINO, limits=replace(ROBOTINO.limits, command_timeout=DRIVER_COMMAND_TIMEOUT))
"""What the gate here knows."""

Velocity = tuple[float, float, float]
"""Forward, left [m/s], counter-clockwise [rad/s] of base_link."""


class Answer(NamedTuple):
    """`velocity` for the robot, None for nothing to send; `decision` says why. Allowed speeds and gap are NaN where the
    gate knows none."""

    velocity: Velocity | None
    decision: Decision

    @property
    def state(self) -> str:
        return self.decision.state.value

    @property
    def reason(self) -> str:
        return self.decision.reason


class Gate(Protocol):
    """All times [s] on one monotonic clock."""

    def receive_ranges(self, ranges: Sequence[float], now: float) -> None:
        """Nine infrared readings [m]."""

    def receive_bumper(self, pressed: bool, now: float) -> None: ...

    def receive_odometry(self, x: float, y: float, theta: float, now: float) -> None: ...

    def lose_odometry(self) -> None:
        """The program that measured the odometry has ended."""

    def forget_surroundings(self) -> None:
        """The odometry has started again, or was reset."""

    def receive_command(self, vx: float, vy: float, wz: float, now: float) -> Answer | None:
        """A velocity of the pilot. An answer is to be sent at once."""

    def tick(self, now: float) -> Answer | None:
        """Called 20 times a second. An answer is to be sent."""


class RobotGate:
    """The project's gate with its profile of Robotino.

    Args:
        bumper: The robot has one, and its silence stops the robot.
    """

    def __init__(self, bumper: bool = True) -> None:
        self.gate = VelocityGate(PROFILE, bumper=bumper)
        self._command: Command | None = None
        self._odometry: Odometry | None = None

    def receive_ranges(self, ranges: Sequence[float], now: float) -> None:
        self.gate.update_ranges("infrared", now, ranges)

    def receive_bumper(self, pressed: bool, now: float) -> None:
        self.gate.update_bumper(now, pressed)

    def receive_odometry(self, x: float, y: float, theta: float, now: float) -> None:
        self._odometry = Odometry(x, y, theta, now)

    def lose_odometry(self) -> None:
        self._odometry = None

    def forget_surroundings(self) -> None:
        self.gate.forget_surroundings()

    def receive_command(self, vx: float, vy: float, wz: float, now: float) -> Answer | None:
        self._command = Command(vx, vy, wz, now)
        return None

    def tick(self, now: float) -> Answer | None:
        decision = self.gate.step(now, self._command, self._odometry)
        velocity: Velocity | None = (decision.vx, decision.vy, decision.wz)
        if self._command is None or now - self._command.stamp > SILENT_AFTER:
            velocity = None
        return Answer(velocity, decision)


class BubbleGate:
    """The guide's filter.

    Args:
        radius: Of the bubble [m], from the robot's middle, against points at 0.2 m + reading.
        limits: Of the guide's clamp.
    """

    def __init__(self, radius: float = SAFETY_RADIUS, limits: ClampLimits | None = None) -> None:
        if not (math.isfinite(radius) and radius > 0.0):
            raise ValueError(f"the safety radius must be a positive number of metres, got {radius}")
        self._bubble = Bubble(radius, limits)

    def receive_ranges(self, ranges: Sequence[float], now: float) -> None:
        self._bubble.update_points(points_of_ranges(ranges))

    def receive_bumper(self, pressed: bool, now: float) -> None:
        """Do nothing: the guide ignores the bumper."""

    def receive_odometry(self, x: float, y: float, theta: float, now: float) -> None:
        """Do nothing: the guide ignores odometry."""

    def lose_odometry(self) -> None:
        """Do nothing: the guide ignores odometry."""

    def forget_surroundings(self) -> None:
        """Do nothing: the guide remembers nothing."""

    def log_lines(self) -> str:
        """Return what the guide's node logs of the last command; empty before the first."""
        if self._bubble.breach is None:
            return ""
        return f"SafetyBreach: {self._bubble.breach:d}\nSafeToNavigate: {self._bubble.safe_to_navigate:d}"

    def receive_command(self, vx: float, vy: float, wz: float, now: float) -> Answer | None:
        velocity = self._bubble.command(vx, vy, wz)
        if velocity is None:
            return Answer(None, _decision((0.0, 0.0, 0.0), State.SENSOR_STALE, "No sensor reading yet."))
        if velocity[:2] == (0.0, 0.0) and (vx, vy) != (0.0, 0.0):
            reason = "A point is inside the bubble, and would stay there."
            return Answer(velocity, _decision(velocity, State.BLOCKED, reason))
        return Answer(velocity, _decision(velocity, State.CLEAR, "Free."))

    def tick(self, now: float) -> Answer | None:
        return None


def _decision(velocity: Velocity, state: State, reason: str) -> Decision:
    """Return what the bubble knows: neither distances nor allowed speeds."""
    return Decision(*velocity, state, reason, np.full(SECTORS, math.nan), math.nan, command_age=0.0)
