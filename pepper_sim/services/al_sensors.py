"""ALSensors: the events of touch sensors and bumpers, which `pepper_sim.naoqi.body_events` raises."""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import remote


class ALSensors(Extractor):
    """Raises the events of touch sensors and bumpers."""

    name = "ALSensors"
    events = (
        *("RightBumperPressed", "LeftBumperPressed", "BackBumperPressed"),
        *("FrontTactilTouched", "MiddleTactilTouched", "RearTactilTouched"),
        *("HandRightBackTouched", "HandLeftBackTouched", "ChestButtonPressed"),
        "BodyStiffnessChanged",
    )

    @remote("v()")
    def run(self) -> None:
        """Watches the sensors. They always are."""
