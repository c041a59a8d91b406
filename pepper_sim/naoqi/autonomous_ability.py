"""AutonomousAbility: a switch of autonomous life. The simulated robot keeps its state and does not move by itself."""

from __future__ import annotations

from pepper_sim.naoqi.service import Service, remote


class AutonomousAbility(Service):
    """Base of the autonomous abilities: switched on or off, and nothing else."""

    def __init__(self) -> None:
        self._enabled = False

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches the ability on or off."""
        self._enabled = enabled

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether the ability is on."""
        return self._enabled

    @remote("b()")
    def isRunning(self) -> bool:
        """Whether the ability is active now: never, because nothing moves by itself."""
        return False
