"""Safety gates under test, one instance for a whole batch: none, bubble, uniform scaling, and the gate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from rto_safe_teleop.bubble import Bubble, ClampLimits, points_of_ranges
from safety.robots import BenchRobot

from telepresence.safety import Command, Odometry, State, VelocityGate


class Gate(Protocol):
    """Between pilots and bases, S of each."""

    def sense(self, name: str, place: int, now: float, stamp: float, ranges: np.ndarray) -> None:
        """Readings of one source arrive in one place."""

    def bump(self, place: int, now: float, pressed: bool, bearing: float | None) -> None:
        """The state of a bumper changes in one place; it is reset by the pilot when released."""

    def tick(self, now: float, place: int, command: Command | None, fresh: bool, odometry: Odometry) -> tuple:
        """Velocity for the base (vx, vy, wz) at 20 Hz. `fresh`: the command has just come."""

    def swing(self, place: int) -> float:
        """How far the body is turned from the pilot's heading [rad]."""

    def state(self, place: int) -> State:
        """What the pilot is shown."""


MakeGate = Callable[[BenchRobot, int], Gate]


class NoGate:
    """The command goes through and stays until the next one."""

    def __init__(self, robot: BenchRobot, count: int) -> None:
        self._robot = robot
        self._out = [(0.0, 0.0, 0.0)] * count

    def sense(self, name: str, place: int, now: float, stamp: float, ranges: np.ndarray) -> None:
        pass

    def bump(self, place: int, now: float, pressed: bool, bearing: float | None) -> None:
        pass

    def tick(self, now: float, place: int, command: Command | None, fresh: bool, odometry: Odometry) -> tuple:
        if fresh and command is not None:
            self._out[place] = self._filter(place, command)
        return self._out[place]

    def swing(self, place: int) -> float:
        return 0.0

    def state(self, place: int) -> State:
        return State.CLEAR

    def _filter(self, place: int, command: Command) -> tuple:
        return command.vx, command.vy, command.wz


class BubbleGate(NoGate):
    """The guide's bubble, with scans at 20 Hz (the guide's own driver gives 5)."""

    def __init__(self, robot: BenchRobot, count: int, radius: float) -> None:
        super().__init__(robot, count)
        top = robot.profile.limits.max_speed
        self._bubbles = [Bubble(radius, ClampLimits(max_linear=top)) for _ in range(count)]
        self._points: list[dict] = [{} for _ in range(count)]

    def sense(self, name: str, place: int, now: float, stamp: float, ranges: np.ndarray) -> None:
        if name == "infrared":
            points = points_of_ranges(ranges)
        else:
            points = _points(self._robot, name, ranges).tolist()
        self._points[place][name] = points
        self._bubbles[place].update_points([p for source in self._points[place].values() for p in source])

    def _filter(self, place: int, command: Command) -> tuple:
        sent = self._bubbles[place].command(command.vx, command.vy, command.wz)
        return self._out[place] if sent is None else sent


class UniformScaling(NoGate):
    """The command rolled forward; all of it is scaled by time to collision over 2 s (the idea of Nav2's "approach").

    Uses what the sensors see at the moment. Runs at every tick, unlike Nav2's monitor.
    """

    HORIZON, STEP = 2.0, 0.1

    def __init__(self, robot: BenchRobot, count: int) -> None:
        super().__init__(robot, count)
        self._points: list[dict] = [{} for _ in range(count)]
        self._times = np.arange(0.0, self.HORIZON + 1e-9, self.STEP)

    def sense(self, name: str, place: int, now: float, stamp: float, ranges: np.ndarray) -> None:
        self._points[place][name] = _points(self._robot, name, ranges)

    def tick(self, now: float, place: int, command: Command | None, fresh: bool, odometry: Odometry) -> tuple:
        if command is None:
            return self._out[place]
        points = np.concatenate([np.empty((0, 2)), *self._points[place].values()])
        scale = 1.0
        if len(points):
            turned = command.wz * self._times
            middle = turned - 0.5 * command.wz * self.STEP
            vx = command.vx * np.cos(middle) - command.vy * np.sin(middle)
            vy = command.vx * np.sin(middle) + command.vy * np.cos(middle)
            x, y = np.cumsum(vx) * self.STEP - vx[0] * self.STEP, np.cumsum(vy) * self.STEP - vy[0] * self.STEP
            dx, dy = points[:, :1] - x, points[:, 1:] - y
            c, s = np.cos(turned), np.sin(turned)
            in_base = np.stack([c * dx + s * dy, c * dy - s * dx], axis=-1).reshape(-1, 2)
            inside = self._robot.profile.outline.measure(in_base)[0].reshape(dx.shape) < 0.0
            hit = np.flatnonzero(inside.any(axis=0))
            scale = self._times[hit[0]] / self.HORIZON if len(hit) else 1.0
        self._out[place] = (command.vx * scale, command.vy * scale, command.wz * scale)
        return self._out[place]


class OurGate:
    """`telepresence.safety.VelocityGate` as it is, one per place."""

    def __init__(self, robot: BenchRobot, count: int, careful: bool = False) -> None:
        self.gates = [VelocityGate(robot.profile, careful=careful) for _ in range(count)]
        self._decisions = [None] * count

    def sense(self, name: str, place: int, now: float, stamp: float, ranges: np.ndarray) -> None:
        self.gates[place].update_ranges(name, now, ranges, stamp)

    def bump(self, place: int, now: float, pressed: bool, bearing: float | None) -> None:
        self.gates[place].update_bumper(now, pressed, bearing)
        if not pressed:
            self.gates[place].reset_bumper()

    def tick(self, now: float, place: int, command: Command | None, fresh: bool, odometry: Odometry) -> tuple:
        decision = self._decisions[place] = self.gates[place].step(now, command, odometry)
        return decision.vx, decision.vy, decision.wz

    def swing(self, place: int) -> float:
        return self._decisions[place].swing if self._decisions[place] else 0.0

    def state(self, place: int) -> State:
        return self._decisions[place].state if self._decisions[place] else State.NO_COMMAND


def _points(robot: BenchRobot, name: str, ranges: np.ndarray) -> np.ndarray:
    """Places of the returns of a source, base_link (n, 2) [m]."""
    source = robot.profile.source(name)
    hit = np.isfinite(ranges) & (ranges >= source.min_range) & (ranges < source.max_range)
    return source.origins[hit] + ranges[hit, None] * source.directions[hit]
