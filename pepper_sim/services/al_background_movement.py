"""ALBackgroundMovement: slight movements while nothing else moves. Source: NAOqi 2.8 documentation,
ALBackgroundMovement: while the robot stands, it breathes (ALMotion.setBreathEnabled).
"""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.client_services import ClientServices

CHAIN = "Body"


class ALBackgroundMovement(AutonomousAbility):
    """Movements while idle."""

    name = "ALBackgroundMovement"

    def __init__(self, clients: ClientServices) -> None:
        super().__init__()
        self._clients = clients
        self._breathing = False

    def changed(self) -> None:
        if self._enabled != self._breathing:
            self._breathing = self._enabled
            self._clients.start("ALMotion", "setBreathEnabled", CHAIN, self._breathing)
