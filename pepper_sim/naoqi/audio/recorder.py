"""Recording the microphones into a WAV or Ogg file on the robot's disk, as ALAudioDevice and ALAudioRecorder do."""

from __future__ import annotations

import logging
import threading
import time
import wave
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.service import ServiceError
from pepper_sim.sound.compressed import write_ogg
from pepper_sim.sound.room import Room, read_channels

log = logging.getLogger(__name__)

_BLOCK = 0.17
MAX_LENGTH = 3600.0
"""A recording that is not stopped ends after this time [s]."""


class MicrophoneRecorder:
    """Records the microphones, one recording at a time."""

    def __init__(self, room: Room, disk: RobotDisk) -> None:
        self._room = room
        self._disk = disk
        self._lock = threading.Lock()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, name: str, rate: int, channels: Sequence[bool], ogg: bool = False) -> None:
        """Start recording.

        Args:
            name: File on the robot's disk.
            channels: Which of the four microphones.
            ogg: Whether it is to be an Ogg file instead of a WAV file.
        Raises:
            ServiceError: A recording is already running, or the file cannot be written.
        """
        with self._lock:
            if self._thread is not None and self._thread.is_alive():
                raise ServiceError("a recording is running already")
            path = self._disk.output(name)
            raw = path.with_name(path.name + ".part") if ogg else path
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                if path.is_dir():
                    raise IsADirectoryError(0, "it is a folder")
                writer = wave.open(str(raw), "wb")
            except OSError as error:
                raise ServiceError(f"'{name}' cannot be written: {error.strerror}") from None
            writer.setnchannels(sum(channels))
            writer.setsampwidth(2)
            writer.setframerate(rate)
            self._ending.clear()
            picked = np.flatnonzero(channels)
            self._thread = threading.Thread(
                target=self._record, args=(writer, rate, picked, raw, path), name="recorder", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """End the recording, if there is one; the file is complete afterwards."""
        with self._lock:
            thread, self._thread = self._thread, None
            self._ending.set()
        if thread is not None:
            thread.join(timeout=3.0)

    def close(self) -> None:
        self._ending.set()
        if self._thread is not None:
            self._thread.join(timeout=3.0)

    def _record(self, writer: wave.Wave_write, rate: int, channels: np.ndarray, raw: Path, path: Path) -> None:
        begin = start = time.monotonic()
        try:
            with writer:
                ended = False
                while not ended and start - begin < MAX_LENGTH:
                    ended = self._ending.wait(max(0.0, start + _BLOCK - time.monotonic()))
                    count = int((time.monotonic() - start) * rate)
                    block = self._room.listen(start, count, rate)[:, channels]
                    writer.writeframes(np.ascontiguousarray(block).astype("<i2").tobytes())
                    start += count / rate
            if raw != path:
                write_ogg(path, *read_channels(raw))
                raw.unlink()
        except (OSError, ValueError) as error:
            log.warning("the recording ended: %s", error)
