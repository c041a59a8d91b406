"""Sound on one clock, without a robot."""

import time

import numpy as np
import pytest

from pepper_sim.sound.room import Loudspeaker, Room, Track, read_wave, sine, write_wave


def test_sounds_add_up_where_they_overlap():
    track, now = Track(), time.monotonic()
    track.play(np.full(100, 0.25), 100, start=now)
    track.play(np.full(100, 0.5), 100, start=now + 0.5)
    mixed = track.render(now - 0.5, 250, 100)
    assert mixed[25] == 0.0 and mixed[75] == pytest.approx(0.25)
    assert mixed[125] == pytest.approx(0.75) and mixed[175] == pytest.approx(0.5) and mixed[-1] == 0.0


def test_another_rate_keeps_the_tone():
    track, now = Track(), time.monotonic()
    track.play(sine(100, 1.0, 22050), 22050, start=now)
    rendered = track.render(now + 0.1, 4800, 48000)
    spectrum = np.abs(np.fft.rfft(rendered))
    assert np.argmax(spectrum) * 10 == 100


def test_a_cut_sound_is_over():
    track = Track()
    now = time.monotonic()
    sound = track.play(np.ones(1000), 100, start=now)
    assert track.playing(now + 5)
    track.cut(sound, now + 1)
    assert not track.playing(now + 5) and sound.end == pytest.approx(now + 1, abs=0.02)
    track.cut(sound, now)
    assert track.render(now, 100, 100).tolist() == [0.0] * 100


def test_old_sounds_are_forgotten():
    track = Track()
    for _ in range(100):
        track.play(np.ones(10), 100, start=time.monotonic() - 100)
    track.play(np.ones(10), 100)
    assert len(track._sounds) <= 2


def test_volume_and_mute():
    speaker = Loudspeaker()
    speaker.volume = 0.5
    loud = speaker.play(np.ones(10), 100)
    speaker.muted = True
    silent = speaker.play(np.ones(10), 100)
    assert loud.samples.max() == pytest.approx(0.5) and silent.samples.max() == 0.0


def test_microphones_hear_the_room_the_loudspeaker_and_their_own_noise():
    speaker = Loudspeaker()
    room = Room(speaker, seed=3)
    quiet = room.listen(0.0, 4800, 48000)
    assert quiet.shape == (4800, 4) and quiet.dtype == np.int16
    assert 5 < quiet.std() < 30 and abs(np.corrcoef(quiet[:, 0], quiet[:, 1])[0, 1]) < 0.1
    now = time.monotonic()
    room.surroundings.play(np.full(4800, 0.5), 48000, start=now)
    assert room.listen(now, 4800, 48000).mean() == pytest.approx(0.5 * 32767, rel=0.01)
    speaker.volume = 1.0
    speaker.play(np.full(4800, 0.5), 48000, start=now + 1.0)
    assert 0.1 * 32767 < room.listen(now + 1.0, 4800, 48000).mean() < 0.3 * 32767
    again = Room(Loudspeaker(), seed=3)
    assert (again.listen(0.0, 4800, 48000) == quiet).all(), "equal seeds, equal noise"


def test_wave_files(tmp_path):
    path = tmp_path / "deep" / "tone.wav"
    write_wave(path, sine(440, 0.1, 16000, 0.5), 16000)
    samples, rate = read_wave(path)
    assert rate == 16000 and len(samples) == 1600 and samples.max() == pytest.approx(0.5, abs=0.01)
    write_wave(path, np.zeros((10, 4), np.int16), 48000)
    assert read_wave(path)[1] == 48000
    (tmp_path / "bad.wav").write_bytes(b"no sound at all")
    with pytest.raises(ValueError, match="not a WAV file"):
        read_wave(tmp_path / "bad.wav")
