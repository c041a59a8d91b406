"""AutonomousAbility: a switch of autonomous life, and whether what it switches is at work now."""

from __future__ import annotations

from typing import ClassVar

from pepper_sim.naoqi.service import Service, remote
from pepper_sim.services.al_autonomous_life import ALAutonomousLife


class AutonomousAbility(Service):
    """Base of the autonomous abilities. ALAutonomousLife keeps the switches, since both services have methods for them.

    Attributes:
        states: States of life in which the ability works; () for every one.
    """

    states: ClassVar[tuple[str, ...]] = ()

    def __init__(self, life: ALAutonomousLife) -> None:
        self._life = life

    @property
    def able(self) -> bool:
        """Whether the ability is on and the robot's state of life lets it work."""
        return self.isEnabled() and (not self.states or self._life.getState() in self.states)

    @property
    def running(self) -> bool:
        """Whether the ability is at work now."""
        return self.able

    def changed(self) -> None:
        """The switch or the state of life may have changed."""

    @remote("v(b)")
    def setEnabled(self, enabled: bool) -> None:
        """Switches the ability on or off."""
        self._life.setAutonomousAbilityEnabled(self.name.removeprefix("AL"), enabled)
        self.changed()

    @remote("b()")
    def isEnabled(self) -> bool:
        """Whether the ability is on."""
        return self._life.getAutonomousAbilityEnabled(self.name.removeprefix("AL"))

    @remote("b()")
    def isRunning(self) -> bool:
        """Whether the ability is at work now."""
        return self.running
