"""ALVoiceEmotionAnalysis: how a person in the room sounds, at the end of a sentence that is long enough.

The voice of the simulated room is espeak-ng's, which has no emotion: every result is "unknown". As on a robot, the
speech recognition must run. Source: NAOqi 2.8 documentation, ALVoiceEmotionAnalysis.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, ClassVar

from pepper_sim.naoqi.service import finite, one_of, remote, within
from pepper_sim.naoqi.sound_extractor import SoundExtractor
from pepper_sim.naoqi.tasks import Alarm
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_speech_recognition import ALSpeechRecognition
from pepper_sim.sound.room import Room, Sound

UNKNOWN: list[Any] = [[0, 0], [0, 0, 0, 0, 0], 0]
"""No emotion recognised: [[index, level], levels of calm, anger, joy, sorrow, laughter, excitement]."""


class ALVoiceEmotionAnalysis(SoundExtractor):
    """Recognises emotions in voices."""

    name = "ALVoiceEmotionAnalysis"
    events = ("ALVoiceEmotionAnalysis/EmotionRecognized",)
    parameters: ClassVar[Mapping[str, float]] = {"MinSignalLength": 2.0}

    def __init__(self, memory: ALMemory, room: Room, recognition: ALSpeechRecognition, alarm: Alarm) -> None:
        super().__init__(memory)
        self._recognition = recognition
        self._alarm = alarm
        room.on_speech(self._analyse)

    @remote("v(sm)")
    def setParameter(self, parameter: str, value: Any) -> None:
        """Sets "MinSignalLength", how long a sentence must last to be analysed [s]."""
        one_of(parameter, self._parameters, "parameter")
        self._parameters[parameter] = within(finite(value, "value"), 0.0, 3600.0, "value")

    def _analyse(self, text: str, sound: Sound) -> None:
        length = len(sound.samples) / sound.rate
        if self.active and self._recognition.running and length >= self._parameters["MinSignalLength"]:
            end = self._alarm.after(sound.end - time.monotonic())
            end.add_done_callback(lambda done: self.memory.announce(self.events[0], UNKNOWN))
