"""A browser's recorded microphone and camera, what its page plays, and how well a sentence has come through."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
from open_page import OpenPage
from sound_lab import RATE, match, sentence

from pepper_sim.sound.room import write_wave

PIECE = 0.5
"""[s] of speech that are compared at a time."""
LIKENESS = 0.9
"""Likeness wanted, as between the microphone and the robot, see test_voice.py."""
PAUSE = 1.0
"""[s] between two times that the sentence is said."""
ORANGE = (240, 120, 20)
"""What the camera films: one colour."""
SETTLED = "localStorage.setItem('sound', JSON.stringify({headset: true}))"
"""A voice that is left as it is can be compared."""
RECORD = """
(async (seconds) => {
  const track = document.getElementById("robotSound").srcObject.getAudioTracks()[0];
  const reader = new MediaStreamTrackProcessor({ track }).readable.getReader();
  const words = [];
  for (let count = 0; count < seconds * 48000;) {
    const { value } = await reader.read();
    const samples = new Float32Array(value.numberOfFrames);
    value.copyTo(samples, { planeIndex: 0, format: "f32-planar" });
    for (const sample of samples) words.push(Math.round(sample * 32767));
    count += samples.length;
    value.close();
  }
  reader.cancel();
  const bytes = new Uint8Array(Int16Array.from(words).buffer);
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return btoa(text);
})"""


def microphone(path: Path, text: str) -> np.ndarray:
    """Write the file of what a browser's microphone records, again and again; return its samples."""
    samples = np.concatenate([sentence(text), np.zeros(int(PAUSE * RATE), np.float32)])
    write_wave(path, samples, RATE)
    return samples


def camera(path: Path) -> None:
    """Write the file of what its camera films."""
    red, green, blue = (part / 255 for part in ORANGE)
    levels = (  # ITU-R BT.601, 2.5.3
        16 + 65.5 * red + 128.6 * green + 25.0 * blue,
        128 - 37.8 * red - 74.2 * green + 112.0 * blue,
        128 + 112.0 * red - 93.8 * green - 18.2 * blue,
    )
    sizes = (640 * 480, 320 * 240, 320 * 240)
    planes = b"".join(bytes([round(level)]) * size for level, size in zip(levels, sizes, strict=True))
    path.write_bytes(b"YUV4MPEG2 W640 H480 F15:1 Ip A1:1 C420mpeg2\n" + 4 * (b"FRAME\n" + planes))


def devices(sound: Path, film: Path) -> tuple[str, ...]:
    """Return Chromium's options that make these files its microphone and its camera."""
    return (
        "--use-fake-ui-for-media-stream",
        "--use-fake-device-for-media-stream",
        f"--use-file-for-fake-audio-capture={sound}",
        f"--use-file-for-fake-video-capture={film}",
    )


def recorded(browser: OpenPage, seconds: float) -> np.ndarray:
    """What the page plays from now on; silence while its connection is made anew."""
    words = browser.evaluate(f"{RECORD}({seconds})")
    if not isinstance(words, str):  # it has thrown: there is no track yet, or no longer
        return np.zeros(int(seconds * RATE))
    return np.frombuffer(base64.b64decode(words), "<i2") / 32768.0


class Likeness:
    """How well each piece of a sentence has come through so far; a machine that stands still spoils some of them."""

    def __init__(self, samples: np.ndarray) -> None:
        size = int(PIECE * RATE)
        pieces = [samples[at : at + size] for at in range(0, len(samples) - size + 1, size)]
        self._pieces = [piece for piece in pieces if np.sqrt(np.mean(piece**2)) > 0.02]
        self.best = [0.0] * len(self._pieces)

    def listen(self, heard: np.ndarray) -> bool:
        """Compare; whether all pieces have come through."""
        found = (match(piece, heard)[0] for piece in self._pieces)
        self.best = [max(pair) for pair in zip(self.best, found, strict=True)]
        return min(self.best) >= LIKENESS
