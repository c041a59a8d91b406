"""A robot in a world that the test steps, and its navigation; as fast as the machine can compute it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from pepper_sim.models import pepper_model
from pepper_sim.navigation.behaviours import PERIOD, Behaviour, Driver
from pepper_sim.navigation.surveyor import Surveyor
from pepper_sim.robot import Pepper
from telepresence.sim.base import BaseLimits
from telepresence.sim.scene import build_world
from telepresence.sim.world import TICK


class SteppedWheels:
    def __init__(self, robot):
        self._robot = robot
        self._failures = 0

    def go(self, x, y, theta, speed, rate):
        self._failures = self._robot.snapshot().move_failed.count
        self._robot.base_limits = BaseLimits(speed, rate, 0.3, 0.75)
        return self._robot.move_to([(x, y, theta)])

    def halt(self):
        self._robot.stop_move()

    def obstacle(self):
        failure = self._robot.snapshot().move_failed
        return failure.obstacle[:2] if failure.count > self._failures and failure.cause == "obstacle" else None


class Navigation:
    def __init__(self, scene: str) -> None:
        self.robot = Pepper(build_world(scene, [pepper_model()]), None)
        self.surveyor = Surveyor(self.robot)
        self.reports: list[tuple[str, Any]] = []
        self.driver = Driver(
            self.surveyor, SteppedWheels(self.robot), report=lambda what, value: self.reports.append((what, value))
        )
        self.robot.world.step(40)
        self.surveyor.observe()

    def stand_at(self, x: float, y: float, yaw: float = 0.0) -> None:
        """Put the robot there at once and let its sensors read again; what was seen before is forgotten."""
        with self.robot.world.locked() as data:
            data.qpos[:2] = x, y
            data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self.robot.world.step(40)
        self.surveyor.forget()
        self.surveyor.observe()

    def finish(self, behaviour: Behaviour[Any], longest: float = 600.0) -> Any:
        """Run a behaviour to its end, for at most `longest` simulated seconds."""
        for _ in range(round(longest / PERIOD)):
            try:
                next(behaviour)
            except StopIteration as end:
                return end.value
            self.robot.world.step(round(PERIOD / TICK))
            self.surveyor.observe()
        raise AssertionError(f"not at its end after {longest} s")


@pytest.fixture(scope="session")
def navigation_in() -> Callable[[str], Navigation]:
    return Navigation
