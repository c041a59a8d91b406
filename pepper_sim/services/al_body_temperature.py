"""ALBodyTemperature: diagnosis of hot motors.

The motors' limits are not documented; this simulation warns above LIMIT, and above HOT NAOqi would switch a motor off.
"""

from __future__ import annotations

from pepper_sim.naoqi.joint_names import GROUPS
from pepper_sim.naoqi.service import Module, remote
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory

LIMIT, HOT = 75.0, 90.0
"""Motor temperatures [°C] above which the diagnosis is 1 (warning) and 2 (serious)."""
_DEVICES = ("Head", "LArm", "RArm", "Leg")


class ALBodyTemperature(Module):
    """Reports motors that are too hot."""

    name = "ALBodyTemperature"

    def __init__(self, robot: Pepper, memory: ALMemory) -> None:
        self._robot = robot
        self._notify = True
        memory.declare(("TemperatureStatusChanged", "TemperatureDiagnosisErrorChanged", "HotDeviceDetected"), self.name)

    @remote("v(b)")
    def setEnableNotifications(self, enable: bool) -> None:
        """Switches spoken warnings on or off. Stored only: the simulated robot says no warnings."""
        self._notify = enable

    @remote("b()")
    def areNotificationsEnabled(self) -> bool:
        """Whether spoken warnings are on."""
        return self._notify

    @remote("m()")
    def getTemperatureDiagnosis(self) -> list | None:
        """Returns [level, [chains]] of the hottest motors, or nothing if no motor is too hot."""
        temperatures = self._robot.snapshot().temperatures
        hottest = {device: max(temperatures[joint] for joint in GROUPS[device]) for device in _DEVICES}
        for level, limit in ((2, HOT), (1, LIMIT)):
            devices = [device for device, value in hottest.items() if value >= limit]
            if devices:
                return [level, devices]
        return None
