"""The sounds that are on every robot's disk: tones of our own under the names and paths of the documentation.

Programs play them by path, "/usr/share/naoqi/wav/random.wav", or as the sound set "Aldebaran". Sources of the names:
NAOqi 2.8 documentation, ALAudioPlayer, and programs that were written for robots.
"""

from __future__ import annotations

import numpy as np

from pepper_sim.disk import RobotDisk
from pepper_sim.sound.room import sine, write_wave

RATE = 16000
FOLDER = "/usr/share/naoqi/wav"
ALIASES = ("/opt/aldebaran/share/naoqi/wav", "/opt/naoqi/share/naoqi/wav")
"""Other paths of the same files."""
SOUND_SETS = "/usr/share/naoqi/soundsets"
"""Where the sound sets are: a folder each."""
STANDARD_SET = "Aldebaran"

_LENGTH = 8.0
"""Seconds of random.wav: the documentation asks for its position after three and after five."""
_NOTES: dict[str, tuple[tuple[float, float], ...]] = {
    "begin_reco": ((660.0, 0.09), (880.0, 0.12)),
    "end_reco": ((880.0, 0.09), (660.0, 0.12)),
    "bip_gentle": ((740.0, 0.18),),
    "random_waiting": ((520.0, 0.2), (0.0, 0.1), (620.0, 0.2), (0.0, 0.1), (700.0, 0.3)),
    "outch": ((900.0, 0.06), (500.0, 0.25)),
    "buggy": ((300.0, 0.1), (250.0, 0.1), (300.0, 0.1), (200.0, 0.3)),
}
"""Name -> (frequency [Hz], 0 for a pause, duration [s]), ..."""


def install(disk: RobotDisk) -> None:
    """Write the sounds onto a robot's disk."""
    sounds = {name: _played(notes) for name, notes in _NOTES.items()}
    steps = np.random.default_rng(17).choice((440.0, 495.0, 550.0, 660.0, 740.0), int(_LENGTH / 0.25))
    sounds["random"] = _played(tuple((float(step), 0.25) for step in steps))
    folder, standard = disk.path(FOLDER), disk.path(f"{SOUND_SETS}/{STANDARD_SET}")
    for name, samples in sounds.items():
        write_wave(folder / f"{name}.wav", samples, RATE)
    for alias in (*(disk.path(alias) for alias in ALIASES), standard):
        alias.mkdir(parents=True)
        for name in sounds:
            (alias / f"{name}.wav").hardlink_to(folder / f"{name}.wav")


def _played(notes: tuple[tuple[float, float], ...]) -> np.ndarray:
    return np.concatenate([_note(frequency, duration) for frequency, duration in notes])


def _note(frequency: float, duration: float) -> np.ndarray:
    """Return a tone that begins and ends softly."""
    samples = sine(frequency, duration, RATE, 0.3)
    edge = np.minimum(1.0, np.arange(len(samples)) / (0.01 * RATE)).astype(np.float32)
    return samples * edge * edge[::-1]
