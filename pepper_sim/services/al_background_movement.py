"""ALBackgroundMovement: small movements while idle."""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility


class ALBackgroundMovement(AutonomousAbility):
    """Small movements while nothing happens."""

    name = "ALBackgroundMovement"
