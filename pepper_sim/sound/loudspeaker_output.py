"""Plays what the simulated loudspeaker plays on a sound device, and records it into a WAV file."""

from __future__ import annotations

import logging
import os
import threading
import time
import wave
from pathlib import Path
from typing import BinaryIO

import numpy as np

from pepper_sim.sound.room import FULL_SCALE, Track
from telepresence.security import private_files

log = logging.getLogger(__name__)

RATE = 48000
PERIOD = 0.01
"""Seconds of sound in one block, which is the delay that it adds."""
LEAD = 0.02
"""Seconds of sound kept ahead at the sound device: this thread shares its processor with the physics."""
PATIENCE = 0.0
"""Seconds of additional delay that are accepted on a busy machine."""
MAX_LAG = 0.5
"""Longer pauses of this process are cut out of the sound [s]."""


class LoudspeakerOutput:
    """Renders a track in real time, from construction until `close`.

    Args:
        track: The sound; see `Loudspeaker.track`.
        device: See `telepresence.audio.devices`; "none" opens none. A missing device is retried.
        record: Everything from the start on, silence included, goes into this WAV file: mono, 48 kHz, 16 bits. It is
            valid whenever it is read.
    Raises:
        OSError: The file cannot be written.
    """

    def __init__(self, track: Track, device: str = "none", record: Path | None = None) -> None:
        self._track = track
        self._stream: BinaryIO | None = None
        self._file: wave.Wave_write | None = None
        if record:
            self._stream, self._file = _open(record)
        self.record_start = time.monotonic()
        """When the file's first sample was played [s, monotonic]."""
        self._sink = _Sink(device) if device != "none" else None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="loudspeaker-output", daemon=True)
        if self._file or self._sink:
            self._thread.start()

    def close(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=2.0)
        if self._sink is not None:
            self._sink.close()
        self._end_record()

    def __enter__(self) -> LoudspeakerOutput:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        count, at = int(RATE * PERIOD), self.record_start
        while not self._stop.wait(max(0.0, at + PERIOD - time.monotonic())):
            late = time.monotonic() - at - PERIOD
            if late > MAX_LAG and self._file is None:
                at += late
            samples = self._track.render(at, count, RATE)
            at += PERIOD
            pcm = (np.clip(samples, -1.0, 1.0) * FULL_SCALE).astype("<i2")
            if self._sink is not None:
                self._sink.push(pcm)
            if self._file is not None:
                try:
                    self._file.writeframes(pcm.tobytes())
                except OSError as error:
                    log.error("the loudspeaker's record ends: %s", error)
                    self._end_record()

    def _end_record(self) -> None:
        if self._file is not None and self._stream is not None:
            self._file.close()  # wave does not close a stream that it did not open
            self._stream.close()
        self._file = self._stream = None


def _open(path: Path) -> tuple[BinaryIO, wave.Wave_write]:
    path.parent.mkdir(parents=True, exist_ok=True)
    # Unbuffered: a reader finds everything but the last few milliseconds, even after this process was killed.
    # Conversations are on it: for its owner only.
    descriptor = private_files.open_file(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    stream = open(descriptor, "wb", buffering=0)
    file = wave.open(stream, "wb")
    file.setnchannels(1)
    file.setsampwidth(2)
    file.setframerate(RATE)
    file.writeframes(b"")
    return stream, file


class _Sink:
    """Passes blocks of int16 samples, mono, to a sound device."""

    def __init__(self, device: str) -> None:
        # Imported only if a device is used: the simulator itself needs no GStreamer.
        from telepresence.audio.loudspeaker import Loudspeaker

        self._loudspeaker = Loudspeaker(device, RATE, LEAD, PATIENCE, name="loudspeaker of the simulated robot").start()

    def push(self, samples: np.ndarray) -> None:
        self._loudspeaker.push(np.repeat(samples, 2).tobytes())

    def close(self) -> None:
        self._loudspeaker.close()
