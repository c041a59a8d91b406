"""Echo cancellation, loaded into and out of a sound server of its own."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sound_lab import SoundServer

from telepresence.audio import devices, pipeline
from telepresence.audio.echo import EchoCancellation
from telepresence.audio.microphone import Microphone
from telepresence.audio.output import Output

CHOSEN = ("pilot_mic.monitor", "pilot_speaker")


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SoundServer]:
    server = SoundServer(tmp_path)
    for name, value in server.environment().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(pipeline, "RETRY_PERIOD", 0.5)
    yield server
    server.close()


class Ends:
    """A microphone and a loudspeaker with echo cancellation between them, as the nodes have them."""

    def __init__(self) -> None:
        self.heard = 0
        self.opened = ["", ""]
        self.echo = EchoCancellation(*CHOSEN)
        self.microphone = Microphone(CHOSEN[0], lambda: 48000, self._take, via=self._microphone)
        self.loudspeaker = Output("speaker", CHOSEN[1], "audiotestsrc is-live=true", via=self._loudspeaker)
        self.echo.join(self.microphone.pipeline.reopen, self.loudspeaker.pipeline.reopen)
        self.ends = (self.microphone, self.loudspeaker)
        for end in self.ends:
            end.start()

    def _take(self, frames: bytes) -> None:
        self.heard += len(frames)

    def _microphone(self, choice: str) -> str:
        self.opened[0] = self.echo.microphone(choice)
        return self.opened[0]

    def _loudspeaker(self, choice: str) -> str:
        self.opened[1] = self.echo.loudspeaker(choice)
        return self.opened[1]

    def use(self) -> list[str | None]:
        """The devices that both have open."""
        runs = [end.pipeline.wanted and end.pipeline.problem is None for end in self.ends]
        return [device if running else None for device, running in zip(self.opened, runs, strict=True)]

    def cancelled(self) -> bool:
        return self.use() == ["telepresence_echo_free_pilot", "telepresence_echo_known_pilot"] and len(ours()) == 1

    def steady(self) -> bool:
        """Whether the loudspeaker has played for a while: GStreamer 1.22 hangs when the sound server ends while the
        device starts to play."""
        volume = self.loudspeaker.pipeline.get("volume")
        clock = volume and volume.get_clock()
        return bool(clock) and clock.get_time() - volume.get_base_time() > pipeline.Gst.SECOND

    def close(self) -> None:
        for end in self.ends:
            end.close()
        self.echo.close()


@pytest.fixture
def ends(server: SoundServer, wait_until: Callable) -> Iterator[Ends]:
    ends = Ends()
    wait_until(ends.cancelled, "echo cancellation")
    yield ends
    ends.close()


def modules() -> str:
    return subprocess.run(["pactl", "list", "short", "modules"], capture_output=True, text=True).stdout


def ours() -> list[str]:
    return [line for line in modules().splitlines() if "module-echo-cancel" in line]


def flows(ends: Ends, wait_until: Callable) -> None:
    before = ends.heard
    wait_until(lambda: ends.heard > before + 48000, "the microphone is heard")


def test_the_devices_are_there_while_it_is_loaded_and_once_only(server: SoundServer) -> None:
    abandoned, echo, another = (EchoCancellation(*CHOSEN, owner) for owner in ("pilot", "pilot", "robotino"))
    abandoned.microphone(CHOSEN[0])
    used = [echo.microphone(CHOSEN[0]), echo.loudspeaker(CHOSEN[1])]  # after a program that was killed
    assert len(ours()) == 1
    used += [another.microphone(CHOSEN[0]), another.loudspeaker(CHOSEN[1])]
    names = devices.names()
    assert len(set(used)) == 4 and set(used) <= {*names["microphones"], *names["loudspeakers"]}
    another.close()
    assert len(ours()) == 1, "two robots' voices do not disturb each other"
    echo.close()
    assert not ours()
    abandoned.close()


def test_a_refusal_is_told_once_and_the_devices_are_used_as_they_are(
    server: SoundServer, caplog: pytest.LogCaptureFixture
) -> None:
    echo = EchoCancellation("no_such_microphone", "pilot_speaker")
    for _ in range(2):
        assert echo.microphone("no_such_microphone") == "no_such_microphone"
        assert echo.loudspeaker("pilot_speaker") == "pilot_speaker"
    assert caplog.text.count("the sound server says") == caplog.text.count("use a headset") == 1


def test_without_a_sound_server_the_reason_is_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("PULSE_SERVER", "unix:/nonexistent/socket")
    assert EchoCancellation().microphone("auto") == "auto"
    assert "the sound server" in caplog.text


def test_it_is_there_again_after_the_sound_server_has_ended(
    server: SoundServer, ends: Ends, wait_until: Callable
) -> None:
    wait_until(ends.steady, "both are used")
    server.close()
    wait_until(lambda: all(end.pipeline.problem for end in ends.ends), "both are lost")
    server.start()
    wait_until(ends.cancelled, "echo cancellation")
    flows(ends, wait_until)


@pytest.mark.parametrize("sink", ["pilot_mic", "pilot_speaker"])
def test_it_is_there_again_after_a_device_was_unplugged(
    server: SoundServer, ends: Ends, sink: str, wait_until: Callable
) -> None:
    gone, other = ends.ends if sink == "pilot_mic" else reversed(ends.ends)
    server.unplug(sink)
    wait_until(lambda: gone.pipeline.problem, "that it is gone is told")
    wait_until(lambda: other.pipeline.problem is None and other.device in ends.use(), "the other one plays on")
    assert not ours() and ends.use()[ends.ends.index(gone)] is None, "nor is another device used in its place"
    server.plug(sink)
    wait_until(ends.cancelled, "echo cancellation")
    flows(ends, wait_until)


def test_another_device_is_behind_it_when_it_is_chosen(server: SoundServer, ends: Ends, wait_until: Callable) -> None:
    ends.microphone.choose("robot_mic.monitor")
    wait_until(lambda: ends.cancelled() and "source_master=robot_mic.monitor" in str(ours()), "echo cancellation")
    assert ends.microphone.device == "robot_mic.monitor", "what was chosen, not what is opened for it"
    flows(ends, wait_until)
    ends.microphone.choose("none")
    wait_until(lambda: not ours() and ends.use() == [None, "pilot_speaker"], "nothing to cancel")
    ends.microphone.choose("pilot_mic.monitor")
    wait_until(ends.cancelled, "echo cancellation")


def test_it_lets_go_of_a_microphone_that_is_not_wanted(server: SoundServer, ends: Ends, wait_until: Callable) -> None:
    ends.microphone.pipeline.wanted = ends.echo.wanted = False
    ends.loudspeaker.pipeline.reopen()
    wait_until(lambda: not ours() and ends.use() == [None, "pilot_speaker"], "it is unloaded")
    assert server.listeners("pilot_mic.monitor") == 0
    ends.microphone.pipeline.wanted = ends.echo.wanted = True
    wait_until(ends.cancelled, "echo cancellation")
