"""ALSoundLocalization: from where a person in the room speaks, seen from the head.

Only speech has a place in the simulated room, `room_sounds.SPEAKER_PLACE`. Source: NAOqi 2.8 documentation.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from pepper_sim.naoqi.motion.frames import MotionFrames
from pepper_sim.naoqi.sound_extractor import SoundExtractor
from pepper_sim.naoqi.time_stamp import split_stamp
from pepper_sim.robot import Pepper
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.room import Room, Sound
from pepper_sim.sound.room_sounds import SPEAKER_PLACE

CONFIDENCE = 0.8
"""Confidence of every place: it is known."""
_FRAME_TORSO, _FRAME_ROBOT = 0, 2


class ALSoundLocalization(SoundExtractor):
    """Locates noises."""

    name = "ALSoundLocalization"
    events = ("ALSoundLocalization/SoundLocated", "ALSoundLocalization/SoundsLocated")
    parameters: ClassVar[Mapping[str, float]] = {"Sensitivity": 0.9, "EnergyComputation": 0.0}

    def __init__(self, memory: ALMemory, robot: Pepper, room: Room) -> None:
        super().__init__(memory)
        self._frames = MotionFrames(robot)
        room.on_speech(self._locate)

    def _locate(self, text: str, sound: Sound) -> None:
        if self.active and self.sensitivity > 0.0:
            located = self._located(sound)
            self.memory.announce(self.events[0], located)
            self.memory.announce(self.events[1], [located])

    def _located(self, sound: Sound) -> list[Any]:
        """Return [time, [azimuth, elevation, confidence, energy], head in the torso, head in the robot]."""
        head = np.array(self._frames.getTransform("Head", _FRAME_ROBOT, True)).reshape(4, 4)
        x, y, z, _ = np.linalg.inv(head) @ np.array([*SPEAKER_PLACE, 1.0])
        energy = float(np.abs(sound.samples).max(initial=0.0)) if self._parameters["EnergyComputation"] else 0.0
        return [
            split_stamp(time.time()),
            [math.atan2(y, x), math.atan2(z, math.hypot(x, y)), CONFIDENCE, energy],
            self._frames.getPosition("Head", _FRAME_TORSO, True),
            self._frames.getPosition("Head", _FRAME_ROBOT, True),
        ]
