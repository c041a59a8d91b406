"""ALSoundDetection: settings are kept; no sound is ever detected."""

from __future__ import annotations

from typing import Any

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import finite, one_of, remote
from pepper_sim.services.al_memory import ALMemory


class ALSoundDetection(Extractor):
    """Detects noises."""

    name = "ALSoundDetection"
    events = ("SoundDetected",)

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._parameters: dict[str, float] = {"Sensitivity": 0.9}

    @remote("v(sm)")
    def setParameter(self, parameter: str, value: Any) -> None:
        """Sets a parameter ("Sensitivity", 0 to 1)."""
        self._parameters[one_of(parameter, self._parameters, "parameter")] = finite(value, "value")
