"""Sounds in the simulated room that do not come from the robot: a recording, a tone, a person who speaks."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np

from pepper_sim.sound.room import Sound, Track, read_wave, sine
from pepper_sim.sound.speech import SpeechStyle, synthesise

TONE = "tone"
_TONE = (440.0, 0.1)  # [Hz], amplitude
_AHEAD = 4.0
"""Seconds of a repeated sound that are prepared in advance."""
SPEAKER_PLACE = (1.0, 0.0, 1.6)
"""Where the person who speaks stands, seen from the robot's base: in front of it, with the head at 1.6 m [m]."""
_PERSON = SpeechStyle(voice="en-us", speed=90.0, volume=0.5)


class RoomSounds:
    """Plays into a room's `surroundings`.

    Args:
        background: "" for silence, "tone", or a WAV file that is repeated.
    Raises:
        ValueError, OSError: The file cannot be played.
    """

    def __init__(self, surroundings: Track, background: str = "") -> None:
        self._track = surroundings
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        if not background:
            return
        samples, rate = (
            (sine(_TONE[0], 10.0, 16000, _TONE[1]), 16000) if background == TONE else read_wave(Path(background))
        )
        if not len(samples):
            raise ValueError(f"{background} holds no sound")
        self._thread = threading.Thread(target=self._repeat, args=(samples, rate), name="room-sounds", daemon=True)
        self._thread.start()

    def say(self, text: str, loudness: float = 0.5) -> Sound:
        """Let a person in the room say a text, starting now; returns after the synthesis, before the end of the text.

        Args:
            loudness: Peak amplitude at the robot's microphones, 0 to 1.
        """
        samples, rate = synthesise(text, _PERSON)
        peak = float(np.abs(samples).max(initial=1e-9))
        return self._track.play(samples * np.float32(loudness / peak) if peak > 1e-6 else samples, rate)

    def close(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def _repeat(self, samples: np.ndarray, rate: int) -> None:
        stream = self._track.open(rate)
        position, piece = 0, rate // 2
        while True:
            while stream.end - time.monotonic() < _AHEAD:
                self._track.extend(stream, np.take(samples, range(position, position + piece), mode="wrap"))
                position = (position + piece) % len(samples)
            if self._stop.wait(1.0):
                self._track.cut(stream)
                return
