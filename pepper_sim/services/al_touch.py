"""ALTouch: which touch sensors are pressed."""

from __future__ import annotations

from pepper_sim.naoqi.memory_keys import BUMPERS, TOUCH_SENSORS
from pepper_sim.naoqi.service import Module, remote
from pepper_sim.robot import Pepper


class ALTouch(Module):
    """Reports which touch sensors and bumpers are pressed."""

    name = "ALTouch"

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot

    @remote("[s]()")
    def getSensorList(self) -> list[str]:
        """Lists the sensors."""
        return [device for device, _ in TOUCH_SENSORS.values()] + [device for device, _, _ in BUMPERS.values()]

    @remote("m()")
    def getStatus(self) -> list[list]:
        """Returns [[sensor, pressed, []], ...]."""
        snapshot = self._robot.snapshot()
        touched = [[device, bool(snapshot.touch[name]), []] for name, (device, _) in TOUCH_SENSORS.items()]
        bumped = [[device, bool(snapshot.bumpers[name]), []] for name, (device, _, _) in BUMPERS.items()]
        return touched + bumped
