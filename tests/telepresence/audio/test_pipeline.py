"""Pipelines that are kept running, and the choice of devices."""

from __future__ import annotations

import logging
from collections.abc import Callable

import pytest

from telepresence.audio import devices
from telepresence.audio.pipeline import KeptPipeline, SoundError


def test_levels_are_told_in_decibels_of_full_scale(wait_until: Callable) -> None:
    levels: list[float] = []
    description = (
        "audiotestsrc is-live=true volume=0.5 ! audioconvert ! audio/x-raw,format=S16LE,rate=48000,channels=1 ! "
        "level name=level interval=50000000 ! fakesink"
    )
    pipeline = KeptPipeline("meter", lambda: description, on_level=levels.append).start()
    wait_until(lambda: len(levels) > 2, "levels")
    pipeline.close()
    assert levels[-1] == pytest.approx(-9.03, abs=0.1)  # a sine of half the full scale


def test_what_cannot_be_opened_is_told_once_and_tried_again(
    wait_until: Callable, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("telepresence.audio.pipeline.RETRY_PERIOD", 0.02)
    attempts: list[int] = []

    def describe() -> str:
        attempts.append(1)
        if len(attempts) < 6:
            raise SoundError("the device is away")
        return "audiotestsrc is-live=true ! fakesink"

    with caplog.at_level(logging.WARNING):
        pipeline = KeptPipeline("test", describe).start()
        wait_until(lambda: pipeline.problem is None, "it runs in the end")
        pipeline.close()
    assert len(attempts) == 6
    assert [record.message for record in caplog.records] == ["test: the device is away; trying again until it works"]


@pytest.mark.parametrize(
    ("description", "complaint"),
    [
        ("audiotestsrc ! nosuchelement", "nosuchelement"),
        ("filesrc location=/nonexistent ! fakesink", "Resource not found"),
        ("audiotestsrc num-buffers=2 ! fakesink", "the source ended"),
    ],
)
def test_the_reason_is_told(description: str, complaint: str, wait_until: Callable) -> None:
    problems: list[str | None] = []
    pipeline = KeptPipeline("test", lambda: description, on_state=problems.append).start()
    wait_until(lambda: problems and problems[-1], "a problem")
    pipeline.close()
    assert complaint in str(problems[-1])


def test_another_device_is_used_from_the_moment_it_is_chosen(wait_until: Callable) -> None:
    tones = iter((200, 400))
    pipeline = KeptPipeline("test", lambda: f"audiotestsrc name=source is-live=true freq={next(tones)} ! fakesink")
    pipeline.start()
    wait_until(lambda: pipeline.get("source"), "the first")
    pipeline.reopen()
    wait_until(lambda: pipeline.runs == 2 and pipeline.get("source"), "the second")
    assert pipeline.get("source").get_property("freq") == 400
    pipeline.close()
    assert pipeline.get("source") is None


def test_there_is_none_while_it_is_not_wanted(wait_until: Callable) -> None:
    described: list[int] = []
    pipeline = KeptPipeline("test", lambda: described.append(1) or "audiotestsrc name=source is-live=true ! fakesink")
    pipeline.wanted = False
    pipeline.start()
    wait_until(lambda: pipeline.problem is None, "nothing is wrong")
    for runs in (1, 2):
        assert pipeline.get("source") is None and len(described) == runs - 1
        pipeline.reopen()  # another device was chosen
        pipeline.wanted = True
        wait_until(lambda: pipeline.get("source"), "it runs")
        assert pipeline.runs == runs
        pipeline.wanted = False
        wait_until(lambda: pipeline.get("source") is None, "it is closed")
    pipeline.close()


@pytest.mark.parametrize("choice", ['x" ! filesink location=/tmp/x', "a b", "alsa:", "x" * 300, "ü!"])
def test_a_device_name_cannot_carry_anything_else(choice: str) -> None:
    with pytest.raises(SoundError, match="choose"):
        devices.source(choice)


def test_without_a_sound_server_the_reason_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PULSE_SERVER", "unix:/nonexistent/socket")
    monkeypatch.setattr(devices, "_has_card", lambda: False)
    with pytest.raises(SoundError, match=r"no loudspeaker: no sound server .* and there is no sound card"):
        devices.sink("auto")
    with pytest.raises(SoundError, match="no microphone, as chosen"):
        devices.source("none")
    monkeypatch.setattr(devices, "_has_card", lambda: True)
    assert devices.source("auto").startswith("alsasrc")
    assert devices.source("alsa:hw:1,0").startswith('alsasrc device="hw:1,0"')
    assert "audiotestsrc" in devices.source("test")
