"""SoundExtractor: an extractor of sounds, whose parameters are numbers (NAOqi 2.8 documentation, ALSoundDetection)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import finite, one_of, remote, within
from pepper_sim.services.al_memory import ALMemory

OLD_NAMES = {"Sensibility": "Sensitivity"}
"""Deprecated name of a parameter -> its name."""


class SoundExtractor(Extractor):
    """Base of the extractors of sounds. A subclass names its parameters and their defaults."""

    parameters: ClassVar[Mapping[str, float]] = {}

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._parameters = dict(self.parameters)

    @remote("v(sm)")
    def setParameter(self, parameter: str, value: Any) -> None:
        """Sets a parameter ("Sensitivity", 0 to 1)."""
        name = one_of(OLD_NAMES.get(parameter, parameter), self._parameters, "parameter")
        number = finite(value, "value")
        self._parameters[name] = within(number, 0.0, 1.0, "value") if name == "Sensitivity" else number

    @property
    def sensitivity(self) -> float:
        """Between 0, which detects nothing, and 1."""
        return self._parameters["Sensitivity"]
