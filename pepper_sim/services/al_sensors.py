"""ALSensors: the events of touch sensors and bumpers, which `pepper_sim.naoqi.body_events` raises."""

from __future__ import annotations

from pepper_sim.naoqi.extractor import Extractor


class ALSensors(Extractor):
    """Raises the events of touch sensors and bumpers."""

    name = "ALSensors"
    events = (
        *("RightBumperPressed", "LeftBumperPressed", "BackBumperPressed"),
        *("FrontTactilTouched", "MiddleTactilTouched", "RearTactilTouched"),
        *("HandRightBackTouched", "HandLeftBackTouched", "ChestButtonPressed"),
    )
