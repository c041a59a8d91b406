"""The autonomous abilities do what they are named after while they are on."""

import pytest

from pepper_sim.services import al_autonomous_blinking


@pytest.fixture
def on(naoqi):
    """Switch an ability on; off after the test."""
    used = []

    def switch(name):
        ability = getattr(naoqi, name)
        used.append(ability)
        ability.setEnabled(True)
        return ability

    yield switch
    for ability in used:
        ability.setEnabled(False)


def test_the_robot_breathes(naoqi, on):
    motion, moves = naoqi.ALMotion, naoqi.ALAutonomousMoves
    background = on("ALBackgroundMovement")
    assert background.isRunning() and motion.getBreathEnabled("Body")
    moves.setBackgroundStrategy("none")
    assert not background.isEnabled() and not motion.getBreathEnabled("Body")
    moves.setBackgroundStrategy("backToNeutral")
    assert motion.getBreathEnabled("Body") and moves.getBackgroundStrategy() == "backToNeutral"


def test_the_eyes_blink_while_the_robot_interacts(naoqi, on, wait_until, monkeypatch):
    monkeypatch.setattr(al_autonomous_blinking, "SHORTEST", 0.1)
    monkeypatch.setattr(al_autonomous_blinking, "LONGEST", 0.2)
    leds, life = naoqi.ALLeds, naoqi.ALAutonomousLife

    def open_eyes():
        return leds.getIntensity("FaceLed0")[0] > 0.5

    leds.on("FaceLeds")
    blinking = on("ALAutonomousBlinking")
    assert not blinking.isRunning(), "it does not interact"
    life.setState("interactive")
    blinking.setEnabled(True)
    wait_until(lambda: not open_eyes(), "the eyes are dark")
    wait_until(open_eyes, "they are open again")
    wait_until(lambda: not open_eyes(), "they blink once more")
    life.setState("disabled")
    assert not blinking.isRunning()
    wait_until(lambda: leds.getIntensity("FaceLed0")[0] == 1.0, "the eyes stay open")


def test_the_robot_shows_that_it_listens(naoqi, on, wait_until):
    recognition = naoqi.ALSpeechRecognition
    listening = on("ALListeningMovement")
    assert not listening.isRunning() and naoqi.ALAutonomousMoves.getExpressiveListeningEnabled()
    recognition.subscribe("test")
    wait_until(lambda: any(task[0] == "ListeningMovement" for task in naoqi.ALMotion.getTaskList()), "it moves")
    assert listening.isRunning()
    recognition.unsubscribe("test")
    wait_until(lambda: not listening.isRunning(), "it does not listen any more")
