"""The voice: real time, one text after the other, interruption."""

import threading
import time

import numpy as np
import pytest

from pepper_sim.sound import speech
from pepper_sim.sound.room import Loudspeaker, read_wave
from pepper_sim.sound.speech import SpeechStyle, Voice, synthesise


@pytest.fixture
def voice(tmp_path):
    made = Voice(Loudspeaker(), tmp_path / "last.wav")
    yield made
    made.close()


def test_synthesis_really_speaks_and_speed_changes_the_length():
    samples, rate = synthesise("one two three four five", SpeechStyle())
    slow, _ = synthesise("one two three four five", SpeechStyle(speed=50))
    assert np.abs(samples).max() > 0.05 and 0.5 < len(samples) / rate < 4
    assert len(slow) > 1.5 * len(samples)


def test_text_is_never_read_as_an_option():
    samples, rate = synthesise("--help -v xx; rm -rf /", SpeechStyle())
    assert len(samples) / rate > 0.5


def test_without_a_synthesiser_there_is_silence_of_the_same_order(monkeypatch):
    monkeypatch.setattr(speech, "SPEAKER", "no-such-program")
    samples, rate = synthesise("one two three", SpeechStyle())
    assert not samples.any() and len(samples) / rate == pytest.approx(60 * 3 / 175, rel=0.01)


def test_texts_are_said_in_order_with_their_words(voice):
    events = []
    voice.on_begin = lambda utterance: events.append(utterance.text)
    voice.on_word = lambda word, position: events.append((word, position))
    voice.on_end = lambda interrupted: events.append(interrupted)
    first, second = voice.say("Good day", SpeechStyle()), voice.say("Bye", SpeechStyle())
    assert first.result(20) is True and second.result(20) is True
    assert events == ["Good day", ("Good", 0), ("day", 5), False, "Bye", ("Bye", 0), False]
    samples, _ = read_wave(voice.last_spoken)
    assert samples.any()


def test_stop_interrupts_at_once(voice):
    began = []
    voice.on_begin = began.append
    calls = [voice.say("a rather long sentence that takes its time", SpeechStyle()) for _ in range(3)]
    while not began:
        time.sleep(0.01)
    begin = time.monotonic()
    voice.stop()
    assert [call.result(20) for call in calls] == [False] * 3
    assert time.monotonic() - begin < 5.0, "three sentences take longer"
    assert voice.say("again", SpeechStyle()).result(20) is True


def test_a_cancelled_text_is_not_said(voice):
    began = []
    voice.on_begin = lambda utterance: began.append(utterance.text)
    first, second = voice.say("one", SpeechStyle()), voice.say("two", SpeechStyle())
    second.cancel()
    first.result(20)
    assert voice.say("three", SpeechStyle()).result(20) is True
    assert began == ["one", "three"]


def test_cancelling_the_text_that_is_being_said_falls_silent(voice):
    began, ended = threading.Event(), []
    voice.on_begin, voice.on_end = lambda _: began.set(), ended.append
    first = voice.say("a rather long sentence that takes its time", SpeechStyle())
    assert began.wait(20)
    first.cancel()
    assert voice.say("two", SpeechStyle()).result(20) is True
    assert ended == [True, False], "the first one was interrupted"


def test_a_closed_voice_says_nothing(tmp_path):
    voice = Voice(Loudspeaker(), tmp_path / "last.wav")
    voice.close()
    assert voice.say("hello", SpeechStyle()).result(1) is False
