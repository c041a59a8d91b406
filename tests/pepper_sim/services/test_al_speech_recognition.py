"""ALSpeechRecognition and the extractors of sounds over the wire; a person in the room speaks."""

import time

import pytest

from pepper_sim.sound.room import sine

GRAMMAR = """#BNF+EM V1.1;
!grammar lights;
!start <go>;
!activatable <colour>;
!slot <what>;
<go>: switch !optional(please) the (light | <what>) <colour>;
<colour>: red | green;
"""


@pytest.fixture
def recognition(naoqi):
    service = naoqi.ALSpeechRecognition
    service.removeAllContext()
    yield service
    service.pause(False)
    service.unsubscribe("test")
    service.removeAllContext()
    service.setLanguage("English")
    service.setParameter("NbHypotheses", 1.0)


@pytest.fixture
def spoken(naoqi):
    """Let a person say a sentence; the next value of an event that is not `but`."""

    def say(sentence, event="WordRecognized", but=None):
        values = []
        subscriber = naoqi.ALMemory.subscriber(event)
        link = subscriber.signal.connect(values.append)
        # As `say_nearby` does, with a tone of 0.2 s instead of a voice, which takes a second.
        room = naoqi.simulation.room
        room.spoken(sentence, room.surroundings.play(sine(300.0, 0.2, 16000, 0.5), 16000))
        deadline = time.monotonic() + 15.0
        while not [value for value in values if value != but]:
            assert time.monotonic() < deadline, f"{event} was not raised for {sentence!r}: {values}"
            time.sleep(0.02)
        subscriber.signal.disconnect(link)
        return next(value for value in values if value != but)

    return say


def test_a_vocabulary_against_what_is_said(naoqi, recognition, spoken, refused):
    recognition.setVocabulary(["yes", "no please"], False)
    recognition.subscribe("test")
    assert "pause" in refused(recognition.setVocabulary, ["stop"], False)
    assert spoken("No, please!") == ["no please", pytest.approx(0.6)]
    assert spoken("oh yes") == ["", -3.0]
    recognition.pause(True)
    recognition.setVocabulary(["stop", "stop now"], True)
    recognition.setParameter("NbHypotheses", 2.0)
    recognition.pause(False)
    result = spoken("robot stop now", "WordRecognizedAndGrammar")
    assert result[::3] == ["<...> stop now <...>", "<...> stop <...>"] and result[2] == "modifiable_grammar"
    assert spoken("go", "SpeechDetected", but=True) is False, "the end of the sentence"
    recognition.pause(True)
    assert "empty" in refused(recognition.setWordListAsVocabulary, [])
    assert "languageName" in refused(recognition.setLanguage, "Klingon")


def test_a_grammar_of_the_disk(naoqi, recognition, spoken, refused):
    disk = naoqi.simulation.server.catalogue.disk
    disk.path("/home/nao/lights.bnf").write_text(GRAMMAR)
    assert "compile it first" in refused(recognition.addContext, "/home/nao/lights.bnf", "lights")
    recognition.compile("/home/nao/lights.bnf", "/home/nao/lights.lcf", "English")
    recognition.addContext("/home/nao/lights.lcf", "lights")
    assert recognition.getRules("lights", "activatable") == ["colour"]
    recognition.addWordListToSlot("lights", "what", ["big lamp"])
    recognition.subscribe("test")
    assert spoken("switch please the big lamp red")[0] == "switch please the big lamp red"
    recognition.deactivateRule("lights", "colour")
    assert spoken("switch the light red") == ["", -3.0]
    recognition.saveContextSet("mine")
    recognition.removeContext("lights")
    assert "contextName" in refused(recognition.activateAllRules, "lights")
    recognition.loadContextSet("mine")
    recognition.activateAllRules("lights")
    disk.path("/home/nao/bad.bnf").write_text("!start <a>;\n<a>: (b;")
    assert "line 2, column 8" in refused(recognition.compile, "/home/nao/bad.bnf", "/home/nao/x.lcf", "English")


def test_a_voice_is_detected_and_located(naoqi, spoken):
    detection, localization = naoqi.ALSoundDetection, naoqi.ALSoundLocalization
    detection.subscribe("test")
    localization.subscribe("test")
    naoqi.ALMotion.angleInterpolation("HeadYaw", 0.5, 0.6, True)
    _, (azimuth, elevation, _, _), _, head = spoken("over here", "ALSoundLocalization/SoundLocated")
    assert azimuth == pytest.approx(-0.5, abs=0.1) and abs(elevation) < 0.7 and head[5] == pytest.approx(0.5, abs=0.05)
    ((_, kind, confidence, _),) = spoken("hello", "SoundDetected")
    assert kind in (0, 1) and 0.0 < confidence <= 1.0
    detection.unsubscribe("test")
    localization.unsubscribe("test")
