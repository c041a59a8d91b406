"""ALSoundLocalization: settings are stored; no sound is ever located."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pepper_sim.naoqi.sound_extractor import SoundExtractor


class ALSoundLocalization(SoundExtractor):
    """Locates noises."""

    name = "ALSoundLocalization"
    events = ("ALSoundLocalization/SoundLocated", "ALSoundLocalization/SoundsLocated")
    parameters: ClassVar[Mapping[str, float]] = {"Sensitivity": 0.9, "EnergyComputation": 0.0}
