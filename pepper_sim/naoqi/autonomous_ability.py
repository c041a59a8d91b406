"""AutonomousAbility: a switch of autonomous life, and whether what it switches is at work now."""

from __future__ import annotations

from typing import ClassVar

from pepper_sim.naoqi.service import Service, remote


class AutonomousAbility(Service):
    """Base of the autonomous abilities: on or off, by a client or by ALAutonomousLife.

    Attributes:
        enabled_at_start: Whether the ability is on while the robot's life is disabled, as it is at the start.
    """

    enabled_at_start: ClassVar[bool] = False

    def __init__(self) -> None:
        self._enabled = self.enabled_at_start

    @property
    def running(self) -> bool:
        """Whether the ability is at work now."""
        return self._enabled

    def changed(self) -> None:
        """The switch may have changed."""

    def follow_life(self, able: bool) -> None:
        """Do what ALAutonomousLife says: its switch of the ability, or the state of life, has changed."""
        self.setEnabled(able)

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches the ability on or off."""
        self._enabled = enabled
        self.changed()

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether the ability is on."""
        return self._enabled

    @remote("b()")
    def isRunning(self) -> bool:
        """Whether the ability is at work now."""
        return self.running
