"""ALSpeakingMovement: movement while speaking."""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility
from pepper_sim.naoqi.service import one_of, remote


class ALSpeakingMovement(AutonomousAbility):
    """Movements while the robot speaks."""

    name = "ALSpeakingMovement"

    def __init__(self) -> None:
        super().__init__()
        self._mode = "contextual"

    @remote("v(s)")
    def setMode(self, mode: str) -> None:
        """Sets "random" or "contextual" gestures."""
        self._mode = one_of(mode, ("random", "contextual"), "mode")

    @remote("s()")
    def getMode(self) -> str:
        """Returns "random" or "contextual"."""
        return self._mode

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: dict) -> None:
        """Assigns gestures to words. Ignored."""

    @remote("v()")
    def resetTagsToWords(self) -> None:
        """Removes the assignments of gestures to words."""
