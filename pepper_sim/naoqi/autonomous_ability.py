"""AutonomousAbility: a switch of autonomous life. The simulated robot keeps its state and does not move by itself."""

from __future__ import annotations

from pepper_sim.naoqi.service import Service, remote


class AutonomousAbility(Service):
    """A switch with a name."""

    def __init__(self) -> None:
        self._enabled = False

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
