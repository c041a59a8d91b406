"""ALBattery: how full the battery is."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, remote
from pepper_sim.robot import Pepper


class ALBattery(Module):
    """State of the battery. Its events are raised by `body_events`."""

    name = "ALBattery"

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot

    @remote("i()")
    def getBatteryCharge(self) -> int:
        """Returns the charge [%]."""
        return round(100 * self._robot.snapshot().battery.charge)

    @remote("v(b)")
    def enablePowerMonitoring(self, enable: bool) -> None:
        """Switches the warnings of a low battery (2.1). They are events, and always raised."""
