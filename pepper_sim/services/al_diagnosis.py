"""ALDiagnosis: devices that fail. Source: NAOqi 2.8 documentation, ALDiagnosis."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, remote
from pepper_sim.services.al_memory import ALMemory

_NEGLIGIBLE = 0


class ALDiagnosis(Module):
    """Reports the devices that fail. Those of the simulated robot never do; hot motors are ALBodyTemperature's."""

    name = "ALDiagnosis"

    def __init__(self, memory: ALMemory) -> None:
        memory.declare(("ActiveDiagnosisErrorChanged", "PassiveDiagnosisErrorChanged"), self.name)
        memory.announce("ALDiagnosis/RobotIsReady", True)

    @remote("m()")
    def getActiveDiagnosis(self) -> list:
        """Returns [severity, devices], of what was found out by moving them; severity is 0, 1 or 2."""
        return [_NEGLIGIBLE, []]

    @remote("m()")
    def getPassiveDiagnosis(self) -> list:
        """Returns [severity, devices], of what was found out by watching them; severity is 0, 1 or 2."""
        return [_NEGLIGIBLE, []]
