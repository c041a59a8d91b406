"""Devices without a sound server: nobody answers, and asking again and again leaves nothing behind."""

import os

import pytest

from telepresence.audio import devices
from telepresence.audio.pipeline import SoundError


def used() -> tuple[int, int]:
    """Descriptors and threads of this process."""
    return len(os.listdir("/proc/self/fd")), len(os.listdir("/proc/self/task"))


@pytest.fixture
def no_sound_server(monkeypatch, tmp_path):
    monkeypatch.setenv("PULSE_SERVER", f"unix:{tmp_path}/nobody")
    monkeypatch.setattr(devices, "_CARDS", tmp_path / "cards")


@pytest.mark.parametrize("choose", [devices.source, devices.sink])
def test_asking_for_a_sound_server_that_is_not_there_leaves_nothing_behind(no_sound_server, choose):
    with pytest.raises(SoundError, match="no sound server"):
        choose("auto")
    before = used()
    for _ in range(5):
        with pytest.raises(SoundError, match="no sound server"):
            choose("auto")
    assert used() == before


def test_asking_for_names_without_a_sound_server_leaves_nothing_behind(no_sound_server):
    assert devices.names() == {"microphones": [], "loudspeakers": []}
    before = used()
    for _ in range(5):
        devices.names()
    assert used() == before
