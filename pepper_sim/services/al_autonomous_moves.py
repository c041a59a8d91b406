"""ALAutonomousMoves: older switches of ALListeningMovement and ALBackgroundMovement. Source: NAOqi 2.8 documentation,
ALAutonomousMoves, which declares the two getters void; they return what they are documented to return.
"""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, one_of, remote
from pepper_sim.services.al_background_movement import ALBackgroundMovement
from pepper_sim.services.al_listening_movement import ALListeningMovement

STRATEGIES = ("none", "backToNeutral")


class ALAutonomousMoves(Module):
    """Older form of ALBackgroundMovement and ALListeningMovement."""

    name = "ALAutonomousMoves"

    def __init__(self, background: ALBackgroundMovement, listening: ALListeningMovement) -> None:
        self._background = background
        self._listening = listening

    @remote("v(b)")
    def setExpressiveListeningEnabled(self, enable: bool) -> None:
        """Switches movements while listening on or off."""
        self._listening.setEnabled(enable)

    @remote("b()")
    def getExpressiveListeningEnabled(self) -> bool:
        """Whether movements while listening are on."""
        return self._listening.isEnabled()

    @remote("v(s)")
    def setBackgroundStrategy(self, strategy: str) -> None:
        """Sets "none" or "backToNeutral"."""
        self._background.setEnabled(one_of(strategy, STRATEGIES, "strategy") != STRATEGIES[0])

    @remote("s()")
    def getBackgroundStrategy(self) -> str:
        """Returns "none" or "backToNeutral"."""
        return STRATEGIES[int(self._background.isEnabled())]
