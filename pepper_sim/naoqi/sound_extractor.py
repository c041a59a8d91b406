"""SoundExtractor: an extractor of sounds, whose parameters are numbers (NAOqi 2.8 documentation, ALSoundDetection)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import finite, one_of, remote
from pepper_sim.services.al_memory import ALMemory


class SoundExtractor(Extractor):
    """Base of the extractors of sounds. A subclass names its parameters and their defaults."""

    parameters: ClassVar[Mapping[str, float]] = {}

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._parameters = dict(self.parameters)

    @remote("v(sm)")
    def setParameter(self, parameter: str, value: Any) -> None:
        """Sets a parameter ("Sensitivity", 0 to 1)."""
        self._parameters[one_of(parameter, self._parameters, "parameter")] = finite(value, "value")
