"""ALDialog over the wire: the effect is what the robot says and what ALMemory holds."""

import threading
import time

import pytest

from pepper_sim.naoqi import client_services

GREETING = """topic: ~greeting()
language: enu
u:(hello) hi
u:(who are you) ^call(ALSystem.robotName())
c1:(_*) I am $1
u:(break) ^call(ALSystem.noSuchMethod())
e1: broken
u:(e:FrontTactilTouched) %touch ouch
u:(e:Dialog/NotUnderstood) pardon
proposal: %tea do you want tea
  u1:(yes) %cup here you are
"""


@pytest.fixture
def dialog(naoqi):
    service = naoqi.ALDialog
    service.setLanguage("English")
    before = set(service.getAllLoadedTopics())
    naoqi.ALTextToSpeech.setParameter("speed", 400.0)
    yield service
    naoqi.ALTextToSpeech.resetSpeed()
    service.unsubscribe("test")
    service.setLanguage("English")
    service.resetAll()
    for name in set(service.getAllLoadedTopics()) - before:
        service.unloadTopic(name)


@pytest.fixture
def said(naoqi):
    """Wait until the robot has answered with a text."""

    def wait(text):
        deadline = time.monotonic() + 15.0
        while naoqi.ALMemory.getData("Dialog/LastAnswer") != text:
            assert time.monotonic() < deadline, naoqi.ALMemory.getData("Dialog/LastAnswer")
            time.sleep(0.02)

    return wait


def test_a_topic_answers_what_is_said_typed_and_touched(naoqi, dialog, said):
    memory = naoqi.ALMemory
    name = dialog.loadTopicContent(GREETING)
    dialog.activateTopic(name)
    assert dialog.getActivatedTopics() == ["greeting"]
    dialog.forceInput("hello")
    assert memory.getData("ALTextToSpeech/Status")[1] == "done", "forceInput ends after the answer"
    said("hi")
    assert memory.getListData(["Dialog/LastInput", "Dialog/MatchedTopic", "Dialog/MatchedLine"]) == [
        "hello",
        "greeting",
        "3",
    ]
    assert dialog.getFocus() == "greeting"
    dialog.forceInput("who are you")
    said("I am " + naoqi.ALSystem.robotName())
    dialog.forceInput("break")
    said("broken")
    dialog.gotoTag("tea", "greeting")
    dialog.forceInput("yes")
    said("here you are")
    dialog.subscribe("test")
    naoqi.simulation.simulated.say_nearby("hello")
    said("hi")
    memory.raiseEvent("FrontTactilTouched", 1.0)
    said("ouch")
    dialog.unsubscribe("test")
    naoqi.simulation.simulated.say_nearby("who are you")
    dialog.forceInput("yes")
    assert memory.getData("Dialog/LastAnswer") == "ouch", "nobody listens, and the scope is closed"


def test_topics_of_the_disk_with_what_they_include(naoqi, dialog, refused):
    disk = naoqi.simulation.server.catalogue.disk
    folder = disk.path("/home/nao/talk")
    folder.mkdir()
    (folder / "main.top").write_text("topic: ~main()\nlanguage: enu\ninclude: more.top\nu:(~colour) nice\n")
    (folder / "more.top").write_text("topic: ~more()\nlanguage: enu\nconcept:(colour) [red blue]\nu:(more) yes\n")
    (folder / "bad.top").write_text("topic: ~bad()\nlanguage: enu\nu:(a [b) c\n")
    assert dialog.loadTopic("/home/nao/talk/main.top") == "main"
    assert dialog.getLoadedTopics("English") == ["main", "more"]
    assert "cannot be unloaded" in refused(dialog.unloadTopic, "more")
    dialog.activateTopic("main")
    assert dialog.getActivatedTopics() == ["main", "more"]
    dialog.generateSentences("/home/nao/talk/all.txt", "main", "enu")
    assert (folder / "all.txt").read_text().split() == ["red", "blue"]
    assert "/home/nao/talk/bad.top: line 3, column 8" in refused(dialog.loadTopic, "/home/nao/talk/bad.top")
    assert "not found" in refused(dialog.loadTopic, "missing/x_enu.top")
    assert "line 1, column 1" in refused(dialog.loadTopicContent, "hello")
    assert "'nothing' is not loaded" in refused(dialog.activateTopic, "nothing")
    names = dialog.runTopics(["/home/nao/talk/more.top"])
    assert names == ["more"] and naoqi.ALMemory.getData("Dialog/IsStarted") == 1
    dialog.unloadTopic("main")
    assert naoqi.ALMemory.getData("Dialog/Language/French") == 1


def test_two_topics_share_the_lexicon(naoqi, dialog, said):
    for name in ("one", "two"):
        text = (
            f"topic: ~{name}()\nlanguage: enu\ninclude: lexicon_enu.top\nu:({name} {{~please}}) sure\n u1:(~yes) {name}"
        )
        dialog.activateTopic(dialog.loadTopicContent(text + "\n"))
    dialog.unloadTopic("one")
    assert dialog.getActivatedTopics() == ["lexicon", "two"]
    dialog.forceInput("two please")
    dialog.forceInput("of course")
    said("two")
    dialog.unloadTopic("two")
    assert "lexicon" not in dialog.getAllLoadedTopics()


def test_concepts_users_and_settings(naoqi, dialog, refused):
    dialog.loadTopicContent("topic: ~ride()\nlanguage: enu\ndynamic: thing\nconcept:(fixed) a\nu:(ride _~thing) a $1\n")
    dialog.setConcept("thing", "English", ["bike", "double-decker bus"])
    dialog.addToConcept("thing", "enu", ["horse"])
    assert dialog.getConcept("thing", "English") == ["horse", "bike", "double-decker bus"]
    assert "static" in refused(dialog.setConcept, "fixed", "English", ["b"])
    dialog.clearConcepts()
    assert dialog.getConcept("thing", "English") == []
    dialog.insertUserData("name", "Ada", 7)
    assert dialog.getUserList() == ["7"] and dialog.getUserDataList(7) == ["name"]
    dialog.openSession(7)
    assert naoqi.ALMemory.getData("user/name") == "Ada" and dialog.getUserData("name", 8) == ""
    dialog.closeSession()
    dialog.setConfidenceThreshold("BNF", 0.25, "French")
    assert dialog.getAllConfidenceThresholds()["BNF"]["French"] == 0.25
    dialog.removeAllLanguageThresholds()
    assert dialog.getConfidenceThreshold("BNF", "French") == 0.5
    assert "grammar" in refused(dialog.setConfidenceThreshold, "XYZ", 0.5)
    dialog.setLanguage("French")
    assert naoqi.ALTextToSpeech.getLanguage() == naoqi.ALSpeechRecognition.getLanguage() == "French"
    dialog.resetLanguage()
    assert dialog.getLanguage() == "English"


def test_rules_ask_and_change_what_is_known(naoqi, dialog, said):
    dialog.loadTopicContent(
        "topic: ~colours()\nlanguage: enu\nu:(Bob likes _[blue red]) ok ^addKnowledge(bob, likes, $1)\n"
        'u:(what does he like) ^first["he likes ^queryKnowledge(bob, likes, ?)" nothing]\n'
        'u:(does he like _[blue red]) ^first["yes ^containsKnowledge(bob, likes, $1)" no]\n'
    )
    dialog.activateTopic("colours")
    for text, answer in (
        ("what does he like", "nothing"),
        ("bob likes blue", "ok"),
        ("what does he like", "he likes blue"),
        ("does he like red", "no"),
        ("does he like blue", "yes"),
    ):
        dialog.forceInput(text)
        said(answer)
    naoqi.ALKnowledge.resetKnowledge("com.aldebaran.learning")


def test_a_service_that_does_not_answer_is_passed_over(naoqi, dialog, said, connect, monkeypatch):
    waiting = threading.Event()

    class Hanging:
        def findOutput(self, language, text):
            waiting.wait(30)

    class Fallback:
        def findOutput(self, language, text):
            return "here I am"

    monkeypatch.setattr(client_services, "CALL_TIMEOUT", 0.3)
    client = connect()
    client.registerService("Hanging", Hanging())
    client.registerService("Parrot", Fallback())
    for service in ("Hanging", "Parrot"):
        dialog.addFallback("English", service)
    dialog.forceInput("polly")
    waiting.set()
    for service in ("Hanging", "Parrot"):
        dialog.removeFallback("English", service)
    said("here I am")


def test_a_service_answers_what_no_rule_understands(naoqi, dialog, said):
    class Fallback:
        def findOutput(self, language, text):
            return f"{language} parrot {text}"

    identity = naoqi.session.registerService("Parrot", Fallback())
    dialog.addFallback("English", "Parrot")
    dialog.forceInput("polly")
    said("English parrot polly")
    dialog.removeFallback("English", "Parrot")
    naoqi.session.unregisterService(identity)
