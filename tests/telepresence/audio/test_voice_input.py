"""Whose voice goes to the robot."""

from __future__ import annotations

import numpy as np
import pytest

from telepresence.audio.voice_input import HELD, VoiceInput

HERE = np.full(882, 1000, "<i2").tobytes()
"""A piece of 20 ms at 22050 Hz, stereo, and not silent."""


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def joined():
    clock, out, levels = Clock(), [], []
    return VoiceInput(lambda: 22050, out.append, levels.append, clock), clock, out, levels


def tone(rate: int, seconds: float = 0.02) -> bytes:
    at = np.arange(int(rate * seconds)) / rate
    return (8000 * np.sin(2 * np.pi * 500 * at)).astype("<i2").tobytes()


def test_a_muted_microphone_is_silence_of_the_same_length(joined):
    voice, _, out, _ = joined
    voice.put(HERE)
    voice.open = False
    voice.put(HERE)
    assert out == [HERE, bytes(len(HERE))]


def test_a_voice_from_elsewhere_takes_the_place_of_the_microphone_while_it_comes(joined):
    voice, clock, out, levels = joined
    voice.open = False  # which is the microphone here, and no other
    for _ in range(50):
        voice.put_from_elsewhere(tone(48000), 48000, 1)
        voice.put(HERE)
        clock.now += 0.02
    heard = np.frombuffer(b"".join(out), "<i2").reshape(-1, 2)
    assert abs(len(heard) - 22050) < 100 and (heard[:, 0] == heard[:, 1]).all()
    assert HERE not in out and voice.elsewhere and -20 < levels[-1] < -10
    spectrum = np.abs(np.fft.rfft(heard[:22050, 0], 22050))
    assert np.argmax(spectrum) == pytest.approx(500, abs=2)
    clock.now += HELD
    voice.open = True
    voice.put(HERE)
    assert out[-1] == HERE and not voice.elsewhere


NO_SOUND = (
    (tone(48000), 0, 1),
    (tone(48000), 2**31, 1),
    (tone(48000), 48000, 0),
    (tone(48000), 48000, 255),
    (b"", 48000, 1),
    (b"\0\0\0", 48000, 1),
    (bytes(100_000), 48000, 1),
)


@pytest.mark.parametrize(("frames", "rate", "channels"), NO_SOUND)
def test_what_is_no_piece_of_sound_is_refused(joined, frames, rate, channels):
    voice, _, out, _ = joined
    with pytest.raises(ValueError, match="sound"):
        voice.put_from_elsewhere(frames, rate, channels)
    assert out == [] and not voice.elsewhere
