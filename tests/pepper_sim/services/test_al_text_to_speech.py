"""ALTextToSpeech and ALAnimatedSpeech over the wire: real time, events, interruption."""

import collections
import time
import wave

import pytest

from pepper_sim.services.al_text_to_speech import MAX_QUEUE

TRIES = 4
"""The best of so many counts where something is timed: other programs hold up those of a busy machine."""


@pytest.fixture
def speech(naoqi):
    service = naoqi.ALTextToSpeech
    yield service
    service.stopAll()


def test_say_takes_as_long_as_the_words_and_keeps_them(speech, simulation):
    begin = time.monotonic()
    speech.say("One two three.")
    took = time.monotonic() - begin
    with wave.open(str(simulation.server.catalogue.disk.path("last_spoken.wav"))) as spoken:
        length = spoken.getnframes() / spoken.getframerate()
        samples = spoken.readframes(spoken.getnframes())
    assert 0.4 < length < 5.0 and length <= took < length + 3.0
    assert any(samples), "espeak-ng really spoke"


PLACES = ("PositionOfCurrentWord", "CurrentBookMark")


def test_events_tell_what_is_said(naoqi, speech, wait_until):
    received = []
    subscribers = []
    for event in ("TextStarted", "CurrentSentence", "CurrentWord", "TextDone", "Status", *PLACES):
        subscriber = naoqi.ALMemory.subscriber(f"ALTextToSpeech/{event}")
        subscriber.signal.connect(lambda value, event=event: received.append((event, value)))
        subscribers.append(subscriber)
    speech.say("Hello \\mrk=7\\ Pepper \\mrk=9\\")
    states = ["enqueued", "started", "done"]
    wait_until(
        lambda: [value[1] for event, value in received if event == "Status"] == states, "all states were reported"
    )
    wait_until(lambda: ("TextDone", True) in received, "the end was reported")
    assert ("TextStarted", True) in received and ("CurrentSentence", "Hello Pepper") in received
    words = [value for event, value in received if event == "CurrentWord" and value]
    assert words == ["Hello", "Pepper"]
    wait_until(lambda: len([event for event, _ in received if event in PLACES]) == 4, "all places were reported")
    places, marks = ([value for event, value in received if event == place] for place in PLACES)
    assert places == [0, 1] and marks == [7, 9]


def test_stop_all_interrupts_what_is_said_and_what_waits(naoqi, speech, wait_until):
    interrupted = []
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/TextInterrupted")
    subscriber.signal.connect(interrupted.append)
    calls = [
        speech.say("This sentence is long enough to be interrupted before its end.", _async=True) for _ in range(3)
    ]
    wait_until(lambda: naoqi.ALMemory.getData("ALTextToSpeech/CurrentSentence"), "the robot speaks")
    speech.stopAll()
    for call in calls:
        call.value(10_000)
    wait_until(lambda: interrupted == [True], "the interruption was reported once")


def test_bookmarks_are_reported_after_many_texts_that_were_never_said(naoqi, simulation, speech, wait_until):
    marks = []
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/CurrentBookMark")
    subscriber.signal.connect(marks.append)
    service = next(s for s in simulation.server.catalogue.services if s.name == "ALTextToSpeech")
    for first in (0, MAX_QUEUE):
        calls = [service.speak(f"Text {first + number} \\mrk=1\\ " * 5) for number in range(MAX_QUEUE)]
        service.stopAll()
        for call in calls:
            call.result(10.0)
    speech.say("One \\mrk=777\\ two")
    wait_until(lambda: 777 in marks, "the bookmark was reported")


def test_the_same_text_twice_has_bookmarks_twice(naoqi, speech, wait_until):
    marks = []
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/CurrentBookMark")
    subscriber.signal.connect(marks.append)
    for call in [speech.say(f"One \\mrk={number}\\ two", _async=True) for number in (1, 2)]:
        call.value(20_000)
    wait_until(lambda: sorted(marks) == [1, 2], "both were reported")


@pytest.fixture
def states(naoqi):
    """Number of a text -> what ALTextToSpeech/Status has said of it."""
    found = collections.defaultdict(list)
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/Status")
    subscriber.signal.connect(lambda value: found[value[0]].append(value[1]))
    yield found


def test_the_status_tells_of_every_text_what_becomes_of_it(naoqi, speech, states, wait_until):
    calls = [speech.say("This sentence is long enough to be interrupted.", _async=True) for _ in range(2)]
    wait_until(lambda: naoqi.ALMemory.getData("ALTextToSpeech/TextStarted"), "the robot speaks")
    wait_until(lambda: len(states) == 2, "both texts have a number")
    speech.stopAll()
    for call in calls:
        call.value(10_000)
    wait_until(
        lambda: [states[number] for number in sorted(states)]
        == [["enqueued", "started", "stopped"], ["enqueued", "stopped"]],
        "both were stopped",
    )


def test_a_text_that_cannot_be_said_is_an_error_and_not_the_last_one(
    naoqi, simulation, speech, states, refused, monkeypatch, wait_until
):
    def broken(*_, **__):
        raise OSError("the loudspeaker is broken")

    with monkeypatch.context() as patched:
        patched.setattr(simulation.room.loudspeaker, "play", broken)
        assert "broken" in refused(speech.say, "Hello")
    wait_until(lambda: [*states.values()] == [["enqueued", "started", "thrown"]], "the failure was reported")
    assert naoqi.ALMemory.getListData(["ALTextToSpeech/TextStarted", "ALTextToSpeech/TextDone"]) == [False, True]
    speech.say("Hello")
    wait_until(lambda: [*states.values()][-1] == ["enqueued", "started", "done"], "the next one was said")


def test_signals_tell_of_a_new_language_and_when_the_robot_listens_again(speech, wait_until):
    locales, ends = [], []
    links = speech.languageTTS.connect(locales.append), speech.synchroTTS.connect(ends.append)
    speech.setLanguage("German")
    speech.setLanguage("English")
    wait_until(lambda: locales == ["de_DE", "en_US"], "both languages were told")
    for call in [speech.say(text, _async=True) for text in ("One two three four five.", "Six.")]:
        call.value(20_000)
    wait_until(lambda: [list(end) for end in ends] == [[0, 0]], "the end was told, once")
    speech.languageTTS.disconnect(links[0])
    speech.synchroTTS.disconnect(links[1])


def test_other_services_answer_while_the_robot_speaks(naoqi, speech):
    tries = []
    while not any(seconds < 1.0 and speaks for seconds, speaks in tries):
        assert len(tries) < TRIES, f"(seconds for all answers, whether it spoke on) {tries}"
        call = speech.say("Speaking takes some time, but nobody has to wait for it.", _async=True)
        begin = time.monotonic()
        for _ in range(20):
            naoqi.ALMotion.getRobotVelocity()
            speech.getLanguage()
        tries.append((time.monotonic() - begin, call.isRunning()))
        speech.stopAll()


def test_settings(speech, refused):
    assert speech.getLanguage() == "English" and speech.locale() == "en_US"
    speech.setLanguage("German")
    assert speech.getLanguage() == "German" and speech.locale("French") == "fr_FR"
    speech.setLanguage("English")
    speech.setVolume(0.3)
    assert speech.getVolume() == pytest.approx(0.3)
    speech.setVolume(0.55)
    speech.setParameter("pitchShift", 1.2)
    assert speech.getParameter("pitchShift") == pytest.approx(1.2)
    speech.setParameter("pitchShift", 1.0)
    speech.setParameter("speed", 120.0)
    speech.resetSpeed()
    assert speech.getParameter("speed") == 100.0
    assert speech.getVoice() in speech.getAvailableVoices()
    assert "Klingon" in refused(speech.setLanguage, "Klingon")
    speech.setVolume(2.0)
    assert speech.getVolume() == 1.0
    speech.setVolume(0.55)
    assert "pEffectName" in refused(speech.setParameter, "echo", 1.0)
    assert "characters" in refused(speech.say, "x" * 30_000)
    assert "stringToSay" in refused(speech.say, 5)


def test_nothing_to_say_is_said_at_once(speech):
    tries = []
    while not any(seconds < 0.5 for seconds in tries):
        assert len(tries) < TRIES, f"it took {tries} s"
        begin = time.monotonic()
        speech.say("   ")
        tries.append(time.monotonic() - begin)


def test_speech_into_a_file_of_the_robot(speech, simulation):
    speech.sayToFile("Hello", "/home/nao/hello.wav")
    assert simulation.server.catalogue.disk.path("/home/nao/hello.wav").stat().st_size > 1000


def test_animated_speech_drops_its_tags(naoqi, speech, wait_until, refused):
    sentences = []
    subscriber = naoqi.ALMemory.subscriber("ALTextToSpeech/CurrentSentence")
    subscriber.signal.connect(sentences.append)
    animated = naoqi.ALAnimatedSpeech
    animated.say("^start(animations/Stand/Gestures/Hey_1) Hi \\rspd=150\\ you", {"bodyLanguageMode": "disabled"})
    wait_until(lambda: "Hi you" in sentences, "the words without tags were said")
    animated.setBodyLanguageModeFromStr("random")
    assert animated.getBodyLanguageMode() == 1
    animated.setBodyLanguageMode(2)
    assert "bodyLanguageMode" in refused(animated.say, "hi", {"bodyLanguageMode": "wild"})
