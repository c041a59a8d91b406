"""ALRobotPosture over the wire."""

from pepper_sim.body.postures import POSTURES
from pepper_sim.services.al_robot_posture import has_posture, recognise


def test_going_to_postures_and_recognising_them(naoqi):
    posture = naoqi.ALRobotPosture
    assert posture.getPostureList() == ["Stand", "StandInit", "StandZero", "Crouch"]
    assert posture.goToPosture("StandZero", 1.0) is True
    assert (posture.getPosture(), posture.getPostureFamily()) == ("StandZero", "Standing")
    assert posture.applyPosture("StandInit", 1.0) is True
    assert posture.getPosture() == "Stand"
    assert set(posture.getPostureFamilyList()) == {"Standing", "Crouching"}


def test_a_posture_can_be_stopped(naoqi, wait_until):
    posture = naoqi.ALRobotPosture
    call = posture.goToPosture("Crouch", 0.1, _async=True)
    wait_until(lambda: naoqi.ALMotion.getTaskList(), "the robot moves")
    posture.stopMove()
    assert call.value(5000) is False


def test_wrong_names_and_speeds_are_refused(naoqi, refused):
    posture = naoqi.ALRobotPosture
    assert "postureName" in refused(posture.goToPosture, "Handstand", 0.5)
    assert "speed" in refused(posture.goToPosture, "Stand", 0.0)
    assert "speed" in refused(posture.goToPosture, "Stand", float("nan"))
    assert "pMaxTryNumber" in refused(posture.setMaxTryNumber, 0)
    posture.setMaxTryNumber(3)


def test_a_change_of_posture_raises_an_event(naoqi, wait_until):
    received = []
    subscriber = naoqi.ALMemory.subscriber("PostureChanged")
    subscriber.signal.connect(received.append)
    naoqi.ALRobotPosture.goToPosture("Crouch", 1.0)
    wait_until(lambda: "Crouch" in received, "the new posture was reported")
    assert naoqi.ALMemory.getData("PostureFamilyChanged") in ("Crouching", "Unknown", "Standing")


def test_recognition_ignores_the_hands():
    angles = dict(POSTURES["Crouch"])
    assert recognise(angles) == "Crouch"
    angles["LHand"] = 0.0
    assert has_posture(angles, POSTURES["Crouch"])
    angles["HeadYaw"] = 1.0
    assert recognise(angles) == "Unknown"
