"""ALAutonomousLife and the services around it."""

import time

import pytest

ACTIVITY = "robotvideo/behaviour"


def test_states_wake_the_robot_and_send_it_to_rest(naoqi, wait_until, refused):
    life = naoqi.ALAutonomousLife
    received = []
    subscriber = naoqi.ALMemory.subscriber("AutonomousLife/State")
    subscriber.signal.connect(received.append)
    assert life.getState() == "disabled"
    life.setState("solitary")
    assert life.getState() == "solitary" == naoqi.ALMemory.getData("AutonomousLife/State")
    life.setState("disabled")
    assert naoqi.ALMotion.robotIsWakeUp() is False, "leaving life ends in rest"
    life.setState("interactive")
    assert naoqi.ALMotion.robotIsWakeUp() is True
    life.setState("disabled")
    wait_until(lambda: received == ["solitary", "disabled", "interactive", "disabled"], "every change was reported")
    assert life.getStateHistory(1)[0][0] == "disabled"
    assert "state" in refused(life.setState, "asleep")


@pytest.fixture
def life(naoqi):
    """Life, which is solitary for the length of a test."""
    life = naoqi.ALAutonomousLife
    life.setState("solitary")
    yield life
    life.setState("disabled")
    naoqi.ALMotion.wakeUp()


def test_focus(naoqi, life, refused):
    life.switchFocus(ACTIVITY)
    assert life.focusedActivity() == ACTIVITY == naoqi.ALMemory.getData("AutonomousLife/FocusedActivity")
    life.switchFocus(ACTIVITY, 1)
    life.stopFocus()
    assert life.focusedActivity() == ACTIVITY, "the one below is back"
    life.stopAll()
    life.stopFocus()
    assert life.focusedActivity() == ""
    assert life.getActivityNature(ACTIVITY) == "interactive"
    assert life.getActivityStatistics()[ACTIVITY]["focusCount"] >= 2
    assert life.getFocusHistory()[-1][0] == ACTIVITY
    assert "nowhere/none" in refused(life.switchFocus, "nowhere/none")
    assert "flags" in refused(life.switchFocus, ACTIVITY, 7)


def test_an_interactive_activity_makes_life_interactive_until_the_last_one_ends(naoqi, life, wait_until):
    awareness, states = naoqi.ALBasicAwareness, []
    subscriber = naoqi.ALMemory.subscriber("AutonomousLife/State")
    subscriber.signal.connect(states.append)
    life.switchFocus(ACTIVITY)
    assert life.getState() == "interactive" and awareness.getEngagementMode() == "FullyEngaged"
    awareness.setEngagementMode("SemiEngaged")
    life.switchFocus(ACTIVITY, 1)
    assert awareness.getEngagementMode() == "FullyEngaged", "it finds everything as the state has it"
    life.stopFocus()
    assert life.getState() == "interactive"
    life.stopFocus()
    assert life.getState() == "solitary" and awareness.getEngagementMode() == "Unengaged"
    wait_until(lambda: states == ["interactive", "solitary"], "each change was reported once")


def test_a_solitary_activity_leaves_life_solitary_and_follows_no_interactive_one(naoqi, life, refused, monkeypatch):
    packages = naoqi.simulation.server.catalogue.packages
    monkeypatch.setattr(packages, "nature", lambda activity: "" if activity == ACTIVITY else "solitary")
    other = next(activity for activity in packages.behaviors if activity != ACTIVITY)
    life.switchFocus(other)
    assert life.getState() == "solitary" == life.getActivityNature(other)
    life.switchFocus(ACTIVITY, 1)
    assert "solitary activity" in refused(life.switchFocus, other)
    assert life.focusedActivity() == ACTIVITY and life.getState() == "interactive"
    life.stopFocus()
    assert life.focusedActivity() == other and life.getState() == "solitary"


@pytest.mark.parametrize("state", ["disabled", "safeguard"])
def test_without_life_no_activity_is_in_focus(naoqi, life, refused, state):
    life.switchFocus(ACTIVITY)
    life.setState(state)
    assert life.focusedActivity() == "" and life.getState() == state
    assert f"'{state}'" in refused(life.switchFocus, ACTIVITY)
    assert life.focusedActivity() == "" and life.getState() == state


def test_abilities_and_safeguards(naoqi, refused):
    life = naoqi.ALAutonomousLife
    life.setAutonomousAbilityEnabled("BasicAwareness", False)
    assert life.getAutonomousAbilityEnabled("BasicAwareness") is False
    life.setAutonomousAbilityEnabled("BasicAwareness", True)
    life.setSafeguardEnabled("RobotFell", False)
    assert life.isSafeguardEnabled("RobotFell") is False
    life.setSafeguardEnabled("RobotFell", True)
    life.setRobotOffsetFromFloor(0.1)
    assert life.getRobotOffsetFromFloor() == pytest.approx(0.1)
    before = int(time.time())
    assert before <= life.getLifeTime() <= time.time()
    assert "autonomousAbility" in refused(life.setAutonomousAbilityEnabled, "Flying", True)
    life.setRobotOffsetFromFloor(0.0)


@pytest.mark.parametrize(
    "name", ["ALBackgroundMovement", "ALListeningMovement", "ALSpeakingMovement", "ALAutonomousBlinking"]
)
def test_small_abilities_are_switches(naoqi, name):
    ability = naoqi.session.service(name)
    ability.setEnabled(True)
    assert ability.isEnabled() is True
    ability.setEnabled(False)
    assert ability.isEnabled() is False and ability.isRunning() is False
    ability.setEnabled(name == "ALSpeakingMovement")


def test_modes_of_movement(naoqi, refused):
    naoqi.ALSpeakingMovement.setMode("random")
    assert naoqi.ALSpeakingMovement.getMode() == "random"
    naoqi.ALSpeakingMovement.setMode("contextual")
    assert "strategy" in refused(naoqi.ALAutonomousMoves.setBackgroundStrategy, "wild")
    assert "mode" in refused(naoqi.ALSpeakingMovement.setMode, "wild")


def test_behaviors_start_and_stop(naoqi, wait_until, refused):
    manager = naoqi.ALBehaviorManager
    started, stopped = [], []
    manager.behaviorStarted.connect(started.append)
    manager.behaviorStopped.connect(stopped.append)
    assert manager.isBehaviorInstalled(ACTIVITY) and ACTIVITY in manager.getInstalledBehaviors()
    manager.startBehavior(ACTIVITY)
    assert manager.isBehaviorRunning(ACTIVITY) and manager.getRunningBehaviors() == [ACTIVITY]
    assert "already" in refused(manager.startBehavior, ACTIVITY)
    manager.stopBehavior(ACTIVITY)
    manager.runBehavior(ACTIVITY)
    assert manager.getRunningBehaviors() == []
    wait_until(lambda: started == stopped == [ACTIVITY] * 2, "starts and stops were reported")
    assert "not installed" in refused(manager.startBehavior, "dance/tango")
    assert "not running" in refused(manager.stopBehavior, ACTIVITY)
    manager.stopAllBehaviors()
