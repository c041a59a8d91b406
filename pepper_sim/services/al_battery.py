"""ALBattery: charge of the battery."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, remote
from pepper_sim.robot import Pepper


class ALBattery(Module):
    """Reports the battery's charge; `pepper_sim.naoqi.body_events` raises its events."""

    name = "ALBattery"

    def __init__(self, robot: Pepper) -> None:
        self._robot = robot

    @remote("i()")
    def getBatteryCharge(self) -> int:
        """Returns the charge [%]."""
        return round(100 * self._robot.snapshot().battery.charge)

    @remote("v(b)")
    def enablePowerMonitoring(self, enable: bool) -> None:
        """Switches low-battery warnings (NAOqi 2.1) on or off. Ignored: they are events, which are always raised."""
