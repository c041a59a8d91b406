"""The autonomous abilities do something in the states of life that let them."""

import pytest

from pepper_sim.services import al_autonomous_blinking


@pytest.fixture
def life(naoqi):
    yield naoqi.ALAutonomousLife
    for ability in ("AutonomousBlinking", "BackgroundMovement", "ListeningMovement"):
        naoqi.ALAutonomousLife.setAutonomousAbilityEnabled(ability, True)
    naoqi.ALAutonomousLife.setState("disabled")


def test_the_robot_breathes_while_it_lives(naoqi, life, wait_until):
    background, motion = naoqi.ALBackgroundMovement, naoqi.ALMotion
    assert background.isEnabled() and not background.isRunning()
    life.setState("solitary")
    wait_until(lambda: motion.getBreathEnabled("Body"), "it breathes")
    assert background.isRunning()
    naoqi.ALAutonomousMoves.setBackgroundStrategy("none")
    assert not background.isEnabled() and not motion.getBreathEnabled("Body")
    naoqi.ALAutonomousMoves.setBackgroundStrategy("backToNeutral")
    assert motion.getBreathEnabled("Body") and naoqi.ALAutonomousMoves.getBackgroundStrategy() == "backToNeutral"
    life.setState("disabled")
    wait_until(lambda: not motion.getBreathEnabled("Body"), "it does not breathe any more")


def test_the_eyes_blink_while_it_interacts(naoqi, life, wait_until, monkeypatch):
    monkeypatch.setattr(al_autonomous_blinking, "SHORTEST", 0.1)
    monkeypatch.setattr(al_autonomous_blinking, "LONGEST", 0.2)
    leds = naoqi.ALLeds
    leds.on("FaceLeds")
    life.setState("interactive")
    wait_until(lambda: naoqi.ALAutonomousBlinking.isRunning(), "it interacts")
    for state in ("dark", "light", "dark"):
        wait_until(lambda: (leds.getIntensity("FaceLed0")[0] < 0.5) == (state == "dark"), f"the eyes are {state}")  # noqa: B023
    life.setState("solitary")
    wait_until(lambda: not naoqi.ALAutonomousBlinking.isRunning(), "it does not interact any more")
    wait_until(lambda: leds.getIntensity("FaceLed0")[0] == 1.0, "the eyes stay open")


def test_the_robot_shows_that_it_listens(naoqi, life, wait_until):
    listening, recognition = naoqi.ALListeningMovement, naoqi.ALSpeechRecognition
    life.setState("solitary")
    assert not listening.isRunning()
    recognition.subscribe("test")
    wait_until(lambda: any(task[0] == "ListeningMovement" for task in naoqi.ALMotion.getTaskList()), "it moves")
    assert listening.isRunning()
    recognition.unsubscribe("test")
    wait_until(lambda: not listening.isRunning(), "it does not listen any more")
