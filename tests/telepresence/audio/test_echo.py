"""Echo cancellation, loaded into and out of a sound server of its own."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from sound_lab import SoundServer

from telepresence.audio import devices
from telepresence.audio.echo import EchoCancellation, without_echo
from telepresence.audio.pipeline import SoundError


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SoundServer]:
    server = SoundServer(tmp_path)
    for name, value in server.environment().items():
        monkeypatch.setenv(name, value)
    yield server
    server.close()


def modules() -> str:
    return subprocess.run(["pactl", "list", "short", "modules"], capture_output=True, text=True, check=True).stdout


def test_the_devices_are_there_while_it_is_loaded_and_once_only(server: SoundServer) -> None:
    abandoned = EchoCancellation("pilot_mic.monitor", "pilot_speaker")
    echo = EchoCancellation("pilot_mic.monitor", "pilot_speaker")  # after a program that was killed
    assert modules().count("module-echo-cancel") == 1
    microphone, loudspeaker, another = without_echo("pilot_mic.monitor", "pilot_speaker", "robotino")
    names = devices.names()
    assert {echo.microphone, microphone} <= set(names["microphones"])
    assert {echo.loudspeaker, loudspeaker} <= set(names["loudspeakers"])
    another.close()
    assert modules().count("module-echo-cancel") == 1, "two robots' voices do not disturb each other"
    echo.close()
    assert "module-echo-cancel" not in modules()
    abandoned.close()


def test_a_refusal_is_told_and_the_devices_are_used_as_they_are(
    server: SoundServer, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises(SoundError, match="the sound server says"):
        EchoCancellation("no_such_microphone", "pilot_speaker")
    devices_used = without_echo("no_such_microphone", "pilot_speaker", "pepper")
    assert devices_used == ("no_such_microphone", "pilot_speaker", None)
    assert "use a headset" in caplog.text


def test_without_a_sound_server_the_reason_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PULSE_SERVER", "unix:/nonexistent/socket")
    with pytest.raises(SoundError, match="sound server"):
        EchoCancellation()
