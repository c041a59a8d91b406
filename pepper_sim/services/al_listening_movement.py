"""ALListeningMovement: movement while listening."""

from __future__ import annotations

from pepper_sim.naoqi.autonomous_ability import AutonomousAbility


class ALListeningMovement(AutonomousAbility):
    """Movements while somebody speaks to the robot."""

    name = "ALListeningMovement"
