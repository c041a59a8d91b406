"""ALSoundDetection: settings are stored; no sound is ever detected."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from pepper_sim.naoqi.sound_extractor import SoundExtractor


class ALSoundDetection(SoundExtractor):
    """Detects noises."""

    name = "ALSoundDetection"
    events = ("SoundDetected",)
    parameters: ClassVar[Mapping[str, float]] = {"Sensitivity": 0.9}
