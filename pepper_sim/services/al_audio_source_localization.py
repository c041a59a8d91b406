"""ALAudioSourceLocalization: the name of ALSoundLocalization before NAOqi 1.22."""

from __future__ import annotations

from pepper_sim.services import al_sound_localization


class ALAudioSourceLocalization(al_sound_localization.ALSoundLocalization):
    """Locates noises."""

    name = "ALAudioSourceLocalization"
    events = ("ALAudioSourceLocalization/SoundLocated", "ALAudioSourceLocalization/SoundsLocated")
