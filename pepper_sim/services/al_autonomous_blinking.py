"""ALAutonomousBlinking: blinking."""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility


class ALAutonomousBlinking(AutonomousAbility):
    """Blinking of the eyes."""

    name = "ALAutonomousBlinking"
