"""The small services of autonomous life: movement while idle, listening or speaking; blinking; ALAutonomousMoves.

They are switches. The simulated robot keeps their state and does not move by itself.
"""

from __future__ import annotations

from typing import ClassVar

from pepper_sim.naoqi.service import Module, Service, one_of, remote


class _Ability(Service):
    """A switch with a name."""

    initially: ClassVar[bool] = False

    def __init__(self) -> None:
        self._enabled = self.initially

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches the ability."""
        self._enabled = enabled

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether the ability is on."""
        return self._enabled

    @remote("b()")
    def isRunning(self) -> bool:
        """Whether the ability is at work: never, there is nothing that moves by itself."""
        return False


class ALBackgroundMovement(_Ability):
    """Small movements while nothing happens."""

    name = "ALBackgroundMovement"


class ALListeningMovement(_Ability):
    """Movements while somebody speaks to the robot."""

    name = "ALListeningMovement"


class ALSpeakingMovement(_Ability):
    """Movements while the robot speaks."""

    name = "ALSpeakingMovement"

    def __init__(self) -> None:
        super().__init__()
        self._mode = "contextual"

    @remote("v(s)")
    def setMode(self, mode: str) -> None:
        """Chooses "random" or "contextual" gestures."""
        self._mode = one_of(mode, ("random", "contextual"), "mode")

    @remote("s()")
    def getMode(self) -> str:
        """Returns "random" or "contextual"."""
        return self._mode

    @remote("v(m)")
    def addTagsToWords(self, tagsToWords: dict) -> None:
        """Teaches which words go with which gestures. Ignored."""

    @remote("v()")
    def resetTagsToWords(self) -> None:
        """Forgets which words go with which gestures."""


class ALAutonomousBlinking(_Ability):
    """Blinking of the eyes."""

    name = "ALAutonomousBlinking"


class ALAutonomousMoves(Module):
    """Older switches of the same."""

    name = "ALAutonomousMoves"

    def __init__(self) -> None:
        self._listening = False
        self._strategy = "none"

    @remote("v(b)")
    def setExpressiveListeningEnabled(self, enable: bool) -> None:
        """Switches movements while listening."""
        self._listening = enable

    @remote("b()")
    def getExpressiveListeningEnabled(self) -> bool:
        """Whether movements while listening are on."""
        return self._listening

    @remote("v(s)")
    def setBackgroundStrategy(self, strategy: str) -> None:
        """Chooses "none" or "backToNeutral"."""
        self._strategy = one_of(strategy, ("none", "backToNeutral"), "strategy")

    @remote("s()")
    def getBackgroundStrategy(self) -> str:
        """Returns "none" or "backToNeutral"."""
        return self._strategy
