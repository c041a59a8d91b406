"""Animations over the wire: by path and tag, with patterns, and what moves."""

import pytest

HEY = "animations/Stand/Gestures/Hey_1"


def test_an_animation_moves_and_comes_back(naoqi, wait_until):
    motion, player = naoqi.ALMotion, naoqi.ALAnimationPlayer
    before = motion.getAngles("Body", False)
    call = player.run("animations/[posture]/Gestures/Hey_1", _async=True)
    wait_until(lambda: motion.getAngles("RShoulderPitch", True)[0] < 0.0, "the arm is up")
    assert naoqi.ALBehaviorManager.getRunningBehaviors() == [HEY]
    call.value(10_000)
    assert motion.getAngles("Body", False) == pytest.approx(before, abs=0.01)
    assert naoqi.ALBehaviorManager.getRunningBehaviors() == []


def test_cancelling_ends_it(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = naoqi.ALAnimationPlayer.runTag("animations/[posture]/Waiting", "think", _async=True)
    wait_until(lambda: motion.getTaskList(), "it moves")
    call.cancel()
    wait_until(lambda: not motion.getTaskList(), "it has ended")
    assert not naoqi.ALBehaviorManager.getRunningBehaviors()


def test_posture_stands_for_the_robot_s_own(naoqi, refused):
    player = naoqi.ALAnimationPlayer
    naoqi.ALRobotPosture.goToPosture("Crouch", 1.0)
    assert "[posture]" in refused(player.run, "animations/[posture]/Gestures/Hey_1")
    assert "[mood]" in refused(player.run, "animations/[mood]/Gestures/Hey_1")
    assert "not installed" in refused(player.run, "animations/Sit/Gestures/Hey_1")


def test_tags_of_one_s_own(naoqi, wait_until, refused):
    player, motion = naoqi.ALAnimationPlayer, naoqi.ALMotion
    player.addTagForAnimations({"Agree": ["nowhere", "animations/[posture]/Gestures/Yes_1"]})
    call = player.runTag("agree", _async=True)
    wait_until(lambda: motion.getTaskList(), "it nods")
    assert [task[2] for task in motion.getTaskList()] == [["HeadYaw", "HeadPitch"]]
    call.cancel()
    player.reset()
    assert "agree" in refused(player.runTag, "agree")
    assert "animations/Sit" in refused(player.runTag, "animations/Sit", "hello")
    assert "tagsToAnimations" in refused(player.addTagForAnimations, [1])
