"""Sound in and around the robot: what is played when, and what the microphones pick up of it. No NAOqi words.

Time is `time.monotonic()` [s]. Samples are float32, mono, -1 to 1, unless stated otherwise.
"""

from __future__ import annotations

import math
import threading
import time
import wave
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from pepper_sim.body.description import MICROPHONES

HISTORY = 12.0
"""How long a sound is kept after its end [s]."""
LOUDSPEAKER_IN_MICROPHONE = 0.3
"""Fraction of the loudspeaker's amplitude that reaches the microphones in the same head."""
NOISE_FLOOR = 12.0 / 32768.0
"""Standard deviation of a microphone in a quiet room."""
FULL_SCALE = 32767.0


@dataclass
class Sound:
    """Samples that play from `start` on, once, or again and again up to `until`."""

    samples: np.ndarray
    rate: int
    start: float
    until: float | None = None

    @property
    def end(self) -> float:
        return self.start + len(self.samples) / self.rate if self.until is None else self.until

    def at(self, moments: np.ndarray) -> np.ndarray:
        """Return the samples at times after `start` [s], linearly interpolated."""
        places = moments * self.rate
        if self.until is not None:
            places = np.where(moments < self.until - self.start, places % len(self.samples), -1.0)
        first = max(0, int(places.min()))
        samples = self.samples[first : int(places.max()) + 2]
        if not len(samples):
            return np.zeros(len(moments), np.float32)
        known = np.arange(first, first + len(samples))
        return np.interp(places, known, samples, left=0.0, right=0.0).astype(np.float32)


_S = TypeVar("_S", bound=Sound)


class Stream(Sound):
    """A sound that is extended at its end: buffers that arrive one after the other and play without a gap.

    Samples older than `HISTORY` may be dropped.
    """

    def __init__(self, rate: int, start: float) -> None:
        self._buffer = np.zeros(int(2 * HISTORY * rate), np.float32)
        self._count = 0
        super().__init__(self._buffer[:0], rate, start)

    def append(self, samples: np.ndarray) -> None:
        """Append float32 samples, at most `HISTORY` seconds of them at once."""
        if self._count + len(samples) > len(self._buffer):
            keep = min(self._count, len(self._buffer) - len(samples), int(HISTORY * self.rate))
            self._buffer[:keep] = self._buffer[self._count - keep : self._count]
            self.start += (self._count - keep) / self.rate
            self._count = keep
        self._buffer[self._count : self._count + len(samples)] = samples
        self._count += len(samples)
        self.samples = self._buffer[: self._count]


class Track:
    """Any number of sounds on one clock."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sounds: list[Sound] = []

    def play(self, samples: np.ndarray, rate: int, start: float | None = None, loop: bool = False) -> Sound:
        """Add a sound; `start` defaults to now. One that loops plays until it is cut."""
        start = time.monotonic() if start is None else start
        until = math.inf if loop and len(samples) else None
        return self._add(Sound(np.asarray(samples, np.float32), rate, start, until))

    def open(self, rate: int, start: float | None = None) -> Stream:
        """Add an empty sound for `extend`; `start` defaults to now."""
        return self._add(Stream(rate, time.monotonic() if start is None else start))

    def extend(self, stream: Stream, samples: np.ndarray) -> None:
        """Make a stream longer."""
        with self._lock:
            stream.append(np.asarray(samples, np.float32))

    def _add(self, sound: _S) -> _S:
        with self._lock:
            limit = time.monotonic() - HISTORY
            self._sounds = [known for known in self._sounds if known.end > limit]
            self._sounds.append(sound)
        return sound

    def cut(self, sound: Sound, at: float | None = None) -> None:
        """End a sound at a time; default now."""
        at = time.monotonic() if at is None else at
        with self._lock:
            if sound.until is not None:
                sound.until = min(sound.until, at)
                return
            keep = max(0, min(len(sound.samples), math.ceil((at - sound.start) * sound.rate)))
            sound.samples = sound.samples[:keep]

    def playing(self, at: float | None = None) -> bool:
        """Whether a sound plays at a time; default now."""
        at = time.monotonic() if at is None else at
        with self._lock:
            return any(sound.start <= at < sound.end for sound in self._sounds)

    def render(self, start: float, count: int, rate: int) -> np.ndarray:
        """Return the sum of all sounds: `count` samples from `start` on at `rate`, linearly interpolated."""
        mixed = np.zeros(count, np.float32)
        stop = start + count / rate
        with self._lock:
            sounds = [sound for sound in self._sounds if sound.start < stop and sound.end > start]
        for sound in sounds:
            mixed += sound.at(start - sound.start + np.arange(count) / rate)
        return mixed


class Loudspeaker:
    """The robot's loudspeaker: a volume, a mute switch, and the track of what it played."""

    def __init__(self) -> None:
        self.track = Track()
        self.volume = 0.6
        """0 to 1."""
        self.muted = False
        self.closed = False
        """Whether another program has it; nothing is played then."""

    def play(
        self, samples: np.ndarray, rate: int, start: float | None = None, gain: float = 1.0, loop: bool = False
    ) -> Sound:
        """Play mono samples at the present volume, once or until they are cut."""
        return self.track.play(self._loud(samples, gain), rate, start, loop)

    def extend(self, stream: Stream, samples: np.ndarray) -> None:
        """Extend a stream of `track` at the present volume."""
        self.track.extend(stream, self._loud(samples))

    def _loud(self, samples: np.ndarray, gain: float = 1.0) -> np.ndarray:
        loudness = 0.0 if self.muted or self.closed else self.volume * gain
        return np.clip(np.asarray(samples, np.float32) * loudness, -1.0, 1.0)


class Room:
    """What the microphones pick up: the robot's own loudspeaker, `surroundings`, and their own noise.

    Args:
        seed: Seed of the noise.
    """

    def __init__(self, loudspeaker: Loudspeaker, seed: int = 0) -> None:
        self.loudspeaker = loudspeaker
        self.surroundings = Track()
        self._random = np.random.default_rng([seed, 4])
        self._lock = threading.Lock()
        self._listeners: list[Callable[[str, Sound], None]] = []
        self.microphones_closed = False
        """Whether another program has the microphones; they pick up nothing then."""
        self._recording: tuple[np.ndarray, int, float] | None = None

    def replace_microphones(self, samples: np.ndarray | None, rate: int = 0) -> None:
        """Let a recording stand for the microphones, from now on and once; None for the microphones.

        Args:
            samples: (n, 4) int16.
        """
        self._recording = None if samples is None else (samples, rate, time.monotonic())

    def on_speech(self, listener: Callable[[str, Sound], None]) -> None:
        """Call `listener(text, sound)` when a person in the room begins to speak."""
        self._listeners.append(listener)

    def spoken(self, text: str, sound: Sound) -> None:
        """Let everybody who listens know which text a sound in the room is; nobody recognises it from its samples."""
        for listener in self._listeners:
            listener(text, sound)

    def listen(self, start: float, count: int, rate: int) -> np.ndarray:
        """Return what the microphones pick up.

        Returns:
            (count, 4) int16, in the order that `description.MICROPHONES` explains. All get the same sound, each with
            noise of its own; the direction of a sound is not modelled.
        """
        if self.microphones_closed:
            return np.zeros((count, MICROPHONES), np.int16)
        if self._recording is not None:
            return _cut(*self._recording, start, count, rate)
        sound = self.surroundings.render(start, count, rate)
        sound += LOUDSPEAKER_IN_MICROPHONE * self.loudspeaker.track.render(start, count, rate)
        with self._lock:
            noise = self._random.standard_normal((count, MICROPHONES), np.float32) * np.float32(NOISE_FLOOR)
        return (np.clip(sound[:, None] + noise, -1.0, 1.0) * FULL_SCALE).astype(np.int16)


def _cut(samples: np.ndarray, recorded_at: int, since: float, start: float, count: int, rate: int) -> np.ndarray:
    """Return what a recording that begins at `since` holds from `start` on; silence outside."""
    at = np.round((start - since + np.arange(count) / rate) * recorded_at).astype(np.int64)
    inside = (at >= 0) & (at < len(samples))
    block = np.zeros((count, MICROPHONES), np.int16)
    block[inside] = samples[at[inside]]
    return block


def sine(frequency: float, duration: float, rate: int, amplitude: float = 1.0) -> np.ndarray:
    """Return a sine tone of `frequency` [Hz] and `duration` [s], sampled at `rate` [Hz]."""
    return (amplitude * np.sin(2.0 * np.pi * frequency * np.arange(int(duration * rate)) / rate)).astype(np.float32)


def write_wave(path: Path, samples: np.ndarray, rate: int) -> None:
    """Write samples as a 16-bit WAV file.

    Args:
        samples: (n,) float32 -1 to 1, or (n, channels) int16.
    """
    if samples.dtype != np.int16:
        samples = (np.clip(samples, -1.0, 1.0) * FULL_SCALE).astype(np.int16)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream, wave.open(stream, "wb") as writer:
        writer.setnchannels(1 if samples.ndim == 1 else samples.shape[1])
        writer.setsampwidth(2)
        writer.setframerate(rate)
        writer.writeframes(samples.astype("<i2").tobytes())


def read_wave(path: Path) -> tuple[np.ndarray, int]:
    """Read a 16-bit WAV file; return the mean of its channels, (n,) float32, and its rate [Hz]; see `read_channels`."""
    samples, rate = read_channels(path)
    return samples.mean(axis=1, dtype=np.float32) / 32768.0, rate


def read_channels(path: Path) -> tuple[np.ndarray, int]:
    """Read a 16-bit WAV file; return its samples, (n, channels) int16, and its rate [Hz].

    Raises:
        ValueError: It is not such a file.
        OSError: It cannot be read.
    """
    try:
        with wave.open(str(path), "rb") as reader:
            if reader.getsampwidth() != 2:
                raise ValueError(f"{8 * reader.getsampwidth()} bits per sample; only 16 can be played")
            frames = reader.readframes(reader.getnframes())
            return np.frombuffer(frames, "<i2").reshape(-1, reader.getnchannels()), reader.getframerate()
    except (wave.Error, EOFError) as error:
        raise ValueError(f"not a WAV file: {error}") from None
