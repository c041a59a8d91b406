"""Waking up, resting, stiffness over the wire."""

import pytest


def test_rest_ends_in_crouch_without_stiffness_and_wake_up_stands(naoqi, wait_until):
    motion, posture = naoqi.ALMotion, naoqi.ALRobotPosture
    received = []
    subscriber = naoqi.ALMemory.subscriber("robotIsWakeUp")
    subscriber.signal.connect(received.append)
    assert motion.robotIsWakeUp() is True
    motion.rest()
    assert motion.robotIsWakeUp() is False
    assert posture.getPosture() == "Crouch"
    assert motion.getStiffnesses("Body") == [0.0] * 17
    motion.wakeUp()
    assert motion.robotIsWakeUp() is True
    assert motion.getStiffnesses("Body") == [1.0] * 17
    assert posture.getPosture() == "Stand"
    wait_until(lambda: received == [False, True], "both changes were reported")


def test_stiffness_applies_to_head_and_arms_and_leaves_the_leg(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setStiffnesses("Body", 0.3)
    wait_until(lambda: motion.getStiffnesses("HeadYaw")[0] < 0.5, "the head is soft")
    values = dict(zip(motion.getBodyNames("Body"), motion.getStiffnesses("Body"), strict=True))
    assert values["HeadYaw"] == values["LHand"] == pytest.approx(0.3)
    assert values["KneePitch"] == values["HipRoll"] == 1.0
    motion.setStiffnesses(["HeadYaw", "RArm"], [0.5, 0.6, 0.6, 0.6, 0.6, 0.6, 0.6])
    wanted = pytest.approx([0.5, 0.6])
    wait_until(lambda: motion.getStiffnesses(["HeadYaw", "RElbowYaw"]) == wanted, "one value per joint")


def test_stiffness_over_time_blocks(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.stiffnessInterpolation("LArm", 0.2, 0.3)
    wait_until(lambda: motion.getStiffnesses("LArm") == pytest.approx([0.2] * 6), "the arm is soft")
    motion.stiffnessInterpolation(["HeadYaw", "HeadPitch"], [[0.5, 0.1], [0.9]], [[0.1, 0.2], [0.1]])
    wait_until(lambda: motion.getStiffnesses("Head") == pytest.approx([0.1, 0.9]), "the last values hold")


def test_one_arm_can_rest(naoqi, refused, wait_until):
    motion = naoqi.ALMotion
    motion.rest("LArm")
    wait_until(lambda: motion.getStiffnesses("LArm") == [0.0] * 6, "the arm is limp")
    assert motion.getStiffnesses("RArm") == [1.0] * 6
    motion.wakeUp("LArm")
    wait_until(lambda: motion.getStiffnesses("LArm") == [1.0] * 6, "the arm is stiff")
    assert "chainName" in refused(motion.rest, "Leg")


def test_motions_of_limp_joints_end_after_their_time(naoqi):
    motion, posture, player = naoqi.ALMotion, naoqi.ALRobotPosture, naoqi.ALAnimationPlayer
    motion.setStiffnesses("LArm", 0.0)
    calls = [
        motion.angleInterpolation("LShoulderPitch", -1.0, 0.3, True, _async=True),
        motion.angleInterpolationWithSpeed("LElbowYaw", 0.0, 0.5, _async=True),
        motion.stiffnessInterpolation("LWristYaw", 0.0, 0.1, _async=True),
        player.run("animations/Stand/Gestures/Yes_1", _async=True),
    ]
    for call in calls:
        call.wait(5000)
        assert call.isFinished()
    assert posture.goToPosture("StandZero", 1.0) is False, "the arm hangs"
    assert motion.getAngles("LShoulderPitch", True)[0] > 1.0
    motion.rest()
    motion.rest()
    assert motion.robotIsWakeUp() is False
    assert posture.goToPosture("Stand", 1.0) is False, "the motors are off"
    assert posture.getPosture() != "Stand"
    assert motion.wakeUp() is True
    assert posture.getPosture() == "Stand"


def test_rest_does_not_wait_for_motions_that_run_or_wait(naoqi, wait_until):
    motion = naoqi.ALMotion
    calls = [motion.angleInterpolation("HeadYaw", angle, 60.0, True, _async=True) for angle in (1.0, -1.0)]
    wait_until(motion.getTaskList, "the first motion runs")
    motion.rest()
    for call in calls:
        call.wait(5000)
        assert call.isFinished()
    rising = motion.wakeUp(_async=True)
    wait_until(lambda: [task[0] for task in motion.getTaskList()] == ["wakeUp"], "the robot stands up")
    motion.rest()
    assert rising.value(5000) is False
    assert motion.getStiffnesses("Body") == [0.0] * 17


def test_rest_is_not_lost_while_somebody_drives(naoqi, wait_until, insist):
    motion = naoqi.ALMotion
    insist("move", 0.2, 0.0, 0.0)
    wait_until(lambda: motion.getRobotVelocity()[0] > 0.15, "the pilot drives")
    motion.rest(_async=True).value(20_000)
    x, y = naoqi.robot.truth()[:2]
    assert motion.robotIsWakeUp() is False
    assert naoqi.ALRobotPosture.getPosture() == "Crouch"
    assert motion.getStiffnesses("Body") == [0.0] * 17
    assert motion.moveTo(0.3, 0.0, 0.0) is False
    assert naoqi.robot.truth()[:2] == pytest.approx((x, y), abs=0.005)
    assert motion.wakeUp() is True
    wait_until(lambda: motion.getRobotVelocity()[0] > 0.15, "awake, it drives again")


def test_a_robot_on_its_way_to_rest_or_up_does_not_drive(naoqi, wait_until):
    motion = naoqi.ALMotion
    for method, asleep in (("rest", True), ("wakeUp", False)):
        x, y = naoqi.robot.truth()[:2]
        call = getattr(motion, method)(_async=True)
        wait_until(lambda method=method: [task[0] for task in motion.getTaskList()] == [method], "it is on its way")
        assert motion.moveTo(0.3, 0.0, 0.0) is False
        motion.move(0.3, 0.0, 0.0)
        call.value(20_000)
        assert motion.robotIsWakeUp() is not asleep
        assert naoqi.robot.truth()[:2] == pytest.approx((x, y), abs=0.005)
    assert motion.moveTo(0.1, 0.0, 0.0) is True


def test_whoever_moves_the_head_keeps_the_robot_neither_from_resting_nor_from_standing_up(naoqi, wait_until, insist):
    motion = naoqi.ALMotion
    insist("setAngles", "HeadYaw", 0.5, 0.2)
    wait_until(lambda: motion.getAngles("HeadYaw", True)[0] > 0.1, "the head moves")
    standing = motion.getAngles("Leg", True)
    motion.rest()
    assert motion.getAngles("Leg", True) == pytest.approx([0.0, -1.04, 0.51], abs=0.05), "crouched"
    assert motion.wakeUp() is True
    assert motion.getAngles("Leg", True) == pytest.approx(standing, abs=0.05)
    wait_until(lambda: motion.getAngles("HeadYaw", True)[0] > 0.1, "the head moves again")


def test_a_second_rest_waits_for_the_first_and_waking_up_does_not(naoqi, wait_until):
    motion = naoqi.ALMotion
    calls = [motion.rest(_async=True) for _ in range(5)]
    for call in calls:
        call.value(20_000)
    assert naoqi.ALRobotPosture.getPosture() == "Crouch"
    assert motion.getStiffnesses("Body") == [0.0] * 17
    motion.wakeUp()
    resting = motion.rest(_async=True)
    wait_until(lambda: [task[0] for task in motion.getTaskList()] == ["rest"], "it crouches")
    assert motion.wakeUp() is True
    resting.value(20_000)
    assert naoqi.ALRobotPosture.getPosture() == "Stand" and motion.robotIsWakeUp()


def test_waking_up_while_a_rest_still_brakes_ends_the_rest(naoqi, wait_until, insist):
    motion, braking = naoqi.ALMotion, []
    subscriber = naoqi.ALMemory.subscriber("ALMotion/Stiffness/restStarted")
    subscriber.signal.connect(braking.append)
    insist("move", 0.35, 0.0, 0.0)
    wait_until(lambda: motion.getRobotVelocity()[0] > 0.3, "the pilot drives")
    resting = motion.rest(_async=True)
    wait_until(lambda: braking, "it brakes")
    assert motion.wakeUp() is True
    resting.value(20_000)
    assert motion.robotIsWakeUp() is True and naoqi.ALRobotPosture.getPosture() == "Stand"
    assert motion.getStiffnesses("Body") == [1.0] * 17


def test_a_second_wake_up_waits_for_the_first_and_nobody_drives_before(naoqi, wait_until):
    motion = naoqi.ALMotion
    standing = motion.getAngles("Leg", True)
    motion.rest()
    calls = [motion.wakeUp(_async=True)]
    wait_until(lambda: [task[0] for task in motion.getTaskList()] == ["wakeUp"], "it stands up")
    calls.append(motion.wakeUp(_async=True))
    motion.move(0.3, 0.0, 0.0)
    assert [call.value(20_000) for call in calls] == [True, True]
    assert motion.getAngles("Leg", True) == pytest.approx(standing, abs=0.05)
    assert naoqi.robot.truth()[:2] == pytest.approx((0.0, 0.0), abs=0.005)
    assert motion.robotIsWakeUp() and motion.moveTo(0.1, 0.0, 0.0) is True


@pytest.mark.parametrize("command", ["rest", "setAngles"])
def test_a_robot_that_did_not_get_up_is_not_awake(naoqi, wait_until, command):
    motion, changes = naoqi.ALMotion, []
    motion.rest()
    subscriber = naoqi.ALMemory.subscriber("robotIsWakeUp")
    subscriber.signal.connect(changes.append)
    rising = motion.wakeUp(_async=True)
    wait_until(lambda: [task[0] for task in motion.getTaskList()] == ["wakeUp"], "it stands up")
    motion.rest() if command == "rest" else motion.setAngles("KneePitch", 0.3, 0.1)
    assert rising.value(20_000) is False
    assert motion.robotIsWakeUp() is False and motion.moveTo(0.3, 0.0, 0.0) is False
    assert motion.wakeUp() is True and naoqi.ALRobotPosture.getPosture() == "Stand"
    wait_until(lambda: changes, "it is awake")
    assert changes == [True]


def test_setting_stiffness_ends_its_interpolation(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.stiffnessInterpolation("Head", 0.5, 60.0, _async=True)
    wait_until(motion.getTaskList, "the task is listed")
    motion.setStiffnesses("HeadYaw", 0.3)
    call.wait(5000)
    assert call.isFinished()
    assert motion.getStiffnesses("HeadYaw") == pytest.approx([0.3])


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("Body", 1.5), "stiffnesses"),
        (("Body", -0.1), "stiffnesses"),
        (("Body", float("nan")), "stiffnesses"),
        (("Body", [0.1, 0.2]), "stiffnesses"),
        (("Tail", 1.0), "Tail"),
        ((None, 1.0), "names"),
    ],
)
def test_malformed_stiffness_is_refused(naoqi, refused, arguments, named):
    assert named in refused(naoqi.ALMotion.setStiffnesses, *arguments)
    assert naoqi.ALMotion.getStiffnesses("HeadYaw") == [1.0]


def test_a_restart_of_the_world_wakes_the_robot(naoqi, simulation):
    naoqi.ALMotion.rest()
    simulation.restart()
    assert naoqi.ALMotion.robotIsWakeUp() is True
    assert naoqi.ALRobotPosture.getPosture() == "Stand"
