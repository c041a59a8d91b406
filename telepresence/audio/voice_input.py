"""Whose voice goes to the robot: that of the microphone here, or one that comes from elsewhere while it comes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from telepresence.audio.pipeline import SILENCE

if TYPE_CHECKING:
    import av

RATES = (8000, 48000)
"""Lowest and highest sampling rate of a voice from elsewhere [Hz]."""
LONGEST = 0.5
"""Seconds of one piece of it."""
HELD = 0.5
"""Seconds after its last piece for which the microphone here stays silent: two people must not alternate."""


class VoiceInput:
    """Joins two voices into one; its two `put` may be called from different threads.

    Args:
        rate: Returns the rate of what leaves here, and of what `put` is given [Hz].
        forward: Gets the voice: int16 little-endian, stereo interleaved.
        on_level: Gets the mean level [dBFS] of a voice from elsewhere.
        clock: Monotonic seconds.
    """

    def __init__(
        self,
        rate: Callable[[], int],
        forward: Callable[[bytes], None],
        on_level: Callable[[float], None] = lambda level: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.open = True
        """Whether the microphone here may be heard; a voice from elsewhere is muted where it comes from."""
        self._rate, self._forward, self._on_level, self._clock = rate, forward, on_level, clock
        self._lock = threading.Lock()
        self._until = 0.0
        self._resampler: av.AudioResampler | None = None
        self._rates = (0, 0)

    @property
    def elsewhere(self) -> bool:
        """Whether the voice comes from elsewhere now."""
        return self._clock() < self._until

    def put(self, frames: bytes) -> None:
        """Take what the microphone here records: int16 little-endian, stereo interleaved."""
        with self._lock:
            if not self.elsewhere:
                # Silence in place of a muted microphone: what comes after it must not find old sound waiting.
                self._forward(frames if self.open else bytes(len(frames)))

    def put_from_elsewhere(self, frames: bytes, rate: int, channels: int) -> None:
        """Take a piece of a voice from elsewhere: int16 little-endian, interleaved.

        Raises:
            ValueError: It is no such piece.
        """
        if not RATES[0] <= rate <= RATES[1] or channels not in (1, 2):
            raise ValueError(f"sound of {rate} Hz and {channels} channels is not played")
        if len(frames) % (2 * channels) or not 0 < len(frames) <= 2 * channels * LONGEST * rate:
            raise ValueError(f"{len(frames)} bytes are no piece of sound of at most {LONGEST:g} s")
        import av  # PyAV and FFmpeg: 15 MB that only a station needs to which somebody speaks

        samples = np.frombuffer(frames, "<i2")
        self._on_level(_level(samples))
        with self._lock:
            self._until = self._clock() + HELD
            wanted = self._rate()
            if self._resampler is None or self._rates != (rate, wanted):
                self._resampler = av.AudioResampler(format="s16", layout="stereo", rate=wanted)
                self._rates = rate, wanted
            layout = "mono" if channels == 1 else "stereo"
            frame = av.AudioFrame.from_ndarray(samples.reshape(1, -1), format="s16", layout=layout)
            frame.sample_rate = rate
            for piece in self._resampler.resample(frame):
                self._forward(bytes(piece.planes[0])[: 4 * piece.samples])


def _level(samples: np.ndarray) -> float:
    power = float(np.mean(np.square(samples, dtype=np.float32))) / 32768.0**2
    return max(SILENCE, 10.0 * float(np.log10(power + 1e-12)))
