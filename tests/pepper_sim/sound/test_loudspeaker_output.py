"""What the loudspeaker plays, in a file, and sounds in the room."""

from __future__ import annotations

import time
import wave
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pepper_sim.sound.loudspeaker_output import RATE, LoudspeakerOutput
from pepper_sim.sound.room import HISTORY, Track, sine, write_wave
from pepper_sim.sound.room_sounds import RoomSounds


def read(path: Path) -> np.ndarray:
    with wave.open(str(path)) as reader:
        assert (reader.getnchannels(), reader.getsampwidth(), reader.getframerate()) == (1, 2, RATE)
        return np.frombuffer(reader.readframes(reader.getnframes()), "<i2").astype(np.float32) / 32768.0


def test_buffers_of_a_stream_have_no_seam() -> None:
    track, rate = Track(), 22050
    tone = sine(441.0, 1.0, rate, 0.5)
    stream = track.open(rate, start=100.0)
    for first in range(0, len(tone), 441):
        track.extend(stream, tone[first : first + 441])
    rendered = track.render(100.1 + 1 / 97000, RATE // 2, RATE)
    steps = np.abs(np.diff(rendered))
    assert steps.max() < 1.2 * 0.5 * 2 * np.pi * 441.0 / RATE, "a click"


def test_a_stream_forgets_what_is_long_over_and_keeps_its_time() -> None:
    track = Track()
    stream = track.open(1000, start=0.0)
    for second in range(100):
        track.extend(stream, np.full(1000, second / 100.0, np.float32))
    assert stream.end == pytest.approx(100.0)
    assert len(stream.samples) <= 2 * HISTORY * 1000
    assert track.render(98.5, 10, 1000) == pytest.approx(0.98) and track.render(99.5, 10, 1000) == pytest.approx(0.99)


def test_the_record_holds_what_was_played_when_it_was_played(tmp_path: Path, wait_until: Callable) -> None:
    track, path = Track(), tmp_path / "deep" / "speaker.wav"
    with LoudspeakerOutput(track, record=path) as output:
        start = time.monotonic() + 0.5
        track.play(sine(500.0, 0.3, 16000, 0.5), 16000, start)
        wait_until(lambda: len(read(path)) > RATE * 1.0, "the sound is recorded")
    record = read(path)
    loud = np.flatnonzero(np.abs(record) > 0.2) / RATE
    assert loud[0] == pytest.approx(start - output.record_start, abs=0.003)
    assert loud[-1] - loud[0] == pytest.approx(0.3, abs=0.005)


def test_a_record_that_cannot_be_written_is_refused() -> None:
    with pytest.raises(OSError):
        LoudspeakerOutput(Track(), record=Path("/proc/nowhere/speaker.wav"))


def test_a_file_is_repeated_in_the_room(tmp_path: Path, wait_until: Callable) -> None:
    path = tmp_path / "radio.wav"
    write_wave(path, sine(300.0, 0.4, 8000, 0.5), 8000)
    track = Track()
    sounds = RoomSounds(track, str(path))
    try:
        begin = time.monotonic() + 1.0
        wait_until(lambda: track.playing(begin + 0.9), "it is prepared")
        assert track.render(begin, 8000, 8000)[:7000].std() > 0.3
    finally:
        sounds.close()
    assert not track.playing(time.monotonic() + 0.5)


def test_a_person_in_the_room_is_heard() -> None:
    track = Track()
    sound = RoomSounds(track).say("Hello there")
    assert 0.4 < sound.end - sound.start < 3.0
    assert np.abs(track.render(sound.start, 16000, 16000)).max() > 0.2


@pytest.mark.parametrize("background", ["/nonexistent.wav", __file__])
def test_a_room_sound_that_cannot_be_played_is_refused(background: str) -> None:
    with pytest.raises((OSError, ValueError)):
        RoomSounds(Track(), background)
