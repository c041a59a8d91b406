"""ALBackgroundMovement: slight movements while nothing else moves. Source: NAOqi 2.8 documentation,
ALBackgroundMovement: while the robot stands, it breathes (ALMotion.setBreathEnabled).
"""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.services.al_autonomous_life import ALAutonomousLife
from pepper_sim.services.al_memory import ALMemory

CHAIN = "Body"


class ALBackgroundMovement(AutonomousAbility):
    """Movements while idle."""

    name = "ALBackgroundMovement"
    states = ("solitary", "interactive")

    def __init__(self, life: ALAutonomousLife, memory: ALMemory, clients: ClientServices) -> None:
        super().__init__(life)
        self._clients = clients
        self._breathing = False
        self._end = memory.follow("AutonomousLife/State", lambda _: self.changed())

    def close(self) -> None:
        self._end()

    def changed(self) -> None:
        """Breathe or stop breathing, after the switch or the state of life has changed."""
        if self.able != self._breathing:
            self._breathing = self.able
            self._clients.start("ALMotion", "setBreathEnabled", CHAIN, self._breathing)
