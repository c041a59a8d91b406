"""ALSoundLocalization: settings are kept; no sound is ever located."""

from __future__ import annotations

from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_sound_detection import ALSoundDetection


class ALSoundLocalization(ALSoundDetection):
    """Tells where noises come from."""

    name = "ALSoundLocalization"
    events = ("ALSoundLocalization/SoundLocated", "ALSoundLocalization/SoundsLocated")

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._parameters = {"Sensitivity": 0.9, "EnergyComputation": 0.0}
