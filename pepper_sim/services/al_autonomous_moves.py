"""ALAutonomousMoves: older switches of movement while idle and listening."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, one_of, remote


class ALAutonomousMoves(Module):
    """Older form of ALBackgroundMovement and ALListeningMovement."""

    name = "ALAutonomousMoves"

    def __init__(self) -> None:
        self._listening = False
        self._strategy = "none"

    @remote("v(b)")
    def setExpressiveListeningEnabled(self, enable: bool) -> None:
        """Switches movements while listening on or off."""
        self._listening = enable

    @remote("b()")
    def getExpressiveListeningEnabled(self) -> bool:
        """Whether movements while listening are on."""
        return self._listening

    @remote("v(s)")
    def setBackgroundStrategy(self, strategy: str) -> None:
        """Sets "none" or "backToNeutral"."""
        self._strategy = one_of(strategy, ("none", "backToNeutral"), "strategy")

    @remote("s()")
    def getBackgroundStrategy(self) -> str:
        """Returns "none" or "backToNeutral"."""
        return self._strategy
