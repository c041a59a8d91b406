"""ALSoundDetection: when a sound begins and ends, by the mean level of the front microphone over 170 ms.

Source: NAOqi 2.8 documentation, ALSoundDetection.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from pepper_sim.body.description import VOICE_RATE
from pepper_sim.naoqi.service import remote
from pepper_sim.naoqi.sound_extractor import SoundExtractor
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.sound.room import FULL_SCALE, Room

WINDOW = 0.17
"""Length of an audio buffer [s]."""
FRONT = 2
"""Number of the front microphone's channel."""
FAINTEST, LOUDEST = 0.001, 0.1
"""Mean levels that are detected with a sensitivity of 1 and of nearly 0; full scale is 1."""


class ALSoundDetection(SoundExtractor):
    """Detects noises."""

    name = "ALSoundDetection"
    events = ("SoundDetected",)
    parameters: ClassVar[Mapping[str, float]] = {"Sensitivity": 0.9}

    def __init__(self, memory: ALMemory, room: Room) -> None:
        super().__init__(memory)
        self._room = room
        self._closing = threading.Event()
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None
        self._index = 0

    def close(self) -> None:
        self._closing.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    @remote("v(sf)")
    def setParameter(self, parameter: str, value: float) -> None:
        """Sets "Sensitivity", 0 (nothing is detected) to 1."""
        super().setParameter(parameter, value)

    @remote("v(s)", "v(sif)")
    def subscribe(self, name: str, period: int = 30, precision: float = 1.0) -> None:
        """Starts the detection for `name`."""
        super().subscribe(name, period, precision)
        with self._starting:
            if self._thread is None or not self._thread.is_alive():
                self._thread = threading.Thread(target=self._run, name="sound-detection", daemon=True)
                self._thread.start()

    def _run(self) -> None:
        sounding = False
        while self.active and not self._closing.wait(WINDOW):
            level, limit = self._level(), LOUDEST * (FAINTEST / LOUDEST) ** self.sensitivity
            if not sounding and self.sensitivity > 0.0 and level > limit:
                sounding = True
                self._report(1, 1.0 - limit / level)
            elif sounding and level < limit / 2.0:
                sounding = False
                self._report(0, 1.0 - level / limit)

    def _level(self) -> float:
        count = int(WINDOW * VOICE_RATE)
        block = self._room.listen(time.monotonic() - WINDOW, count, VOICE_RATE)[:, FRONT]
        return float(np.abs(block.astype(np.float32)).mean()) / FULL_SCALE

    def _report(self, kind: int, confidence: float) -> None:
        self._index += 1
        sound: list[Any] = [self._index, kind, confidence, time.time_ns() // 1000]
        self.memory.announce("SoundDetected", [sound])
