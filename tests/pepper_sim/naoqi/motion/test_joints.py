"""ALMotion's joints over the wire."""

import time

import pytest

NAN = float("nan")
TRIES = 4
"""The best of so many counts where something is timed: other programs hold up those of a busy machine."""


def _near(naoqi, names, angles, wait_until, tolerance=0.03):
    wait_until(
        lambda: naoqi.ALMotion.getAngles(names, True) == pytest.approx(angles, abs=tolerance), f"{names} at {angles}"
    )


def test_set_angles_returns_at_once_and_arrives(naoqi, wait_until):
    motion, tries = naoqi.ALMotion, []
    while not any(seconds < 0.25 for seconds in tries):
        assert len(tries) < TRIES, f"it returned after {tries} s"
        angles = [0.5 * (-1) ** len(tries), 0.2]
        begin = time.monotonic()
        motion.setAngles(["HeadYaw", "HeadPitch"], angles, 0.2)
        tries.append(time.monotonic() - begin)
        _near(naoqi, "Head", angles, wait_until)


def test_speed_is_a_fraction_of_the_joints_top_speed(naoqi, wait_until):
    motion, tries = naoqi.ALMotion, []
    while not any(0.4 < speed < 0.85 for speed in tries):
        assert len(tries) < TRIES, f"0.73 rad/s were {tries}"
        motion.setAngles("HeadYaw", 0.0, 1.0)
        _near(naoqi, "HeadYaw", [0.0], wait_until)
        motion.setAngles("HeadYaw", 1.0, 0.1)
        wait_until(lambda: motion.getAngles("HeadYaw", True)[0] > 0.1, "the head turns")
        first, begin = motion.getAngles("HeadYaw", True)[0], time.monotonic()
        wait_until(lambda: motion.getAngles("HeadYaw", True)[0] > 0.6, "the head turns on")
        tries.append((motion.getAngles("HeadYaw", True)[0] - first) / (time.monotonic() - begin))


def test_each_joint_may_have_its_own_speed(naoqi, wait_until):
    naoqi.ALMotion.setAngles(["HeadYaw", "HeadPitch"], [0.3, 0.1], [0.5, 0.1])
    _near(naoqi, "Head", [0.3, 0.1], wait_until)


def test_chains_may_have_one_value_each(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setAngles(["Head", "LHand"], [0.1, 0.9], 0.5)
    _near(naoqi, ["Head", "LHand"], [0.1, 0.1, 0.9], wait_until)
    motion.angleInterpolation(["Head", "LHand"], [[0.2], [0.5, 0.3]], [[0.3], [0.2, 0.4]], True)
    assert motion.getAngles(["Head", "LHand"], True) == pytest.approx([0.2, 0.2, 0.3], abs=0.03)
    motion.setStiffnesses(["Head", "LArm"], [0.5, 0.6])
    assert motion.getStiffnesses(["Head", "LArm"]) == pytest.approx([0.5] * 2 + [0.6] * 6)


def test_angles_beyond_the_limits_are_clipped(naoqi, wait_until):
    naoqi.ALMotion.setAngles("HeadYaw", 5.0, 1.0)
    _near(naoqi, "HeadYaw", [2.08567], wait_until)


def test_relative_changes(naoqi, wait_until):
    naoqi.ALMotion.setAngles("HeadYaw", 0.2, 1.0)
    _near(naoqi, "HeadYaw", [0.2], wait_until)
    naoqi.ALMotion.changeAngles("HeadYaw", -0.5, 1.0)
    _near(naoqi, "HeadYaw", [-0.3], wait_until)


def test_commanded_and_measured_angles(naoqi):
    motion = naoqi.ALMotion
    assert motion.getAngles("Body", False) == pytest.approx(motion.getAngles("Body", True), abs=0.03)
    assert len(motion.getAngles("Body", True)) == 17
    assert len(motion.getAngles(["LArm", "HeadYaw"], True)) == 7


@pytest.mark.parametrize(
    ("names", "angles", "times", "end"),
    [
        ("HeadYaw", 0.4, 0.4, [0.4]),
        ("HeadYaw", [0.3, -0.3, 0.1], [0.3, 0.6, 0.9], [0.1]),
        (["HeadYaw", "HeadPitch"], [0.3, 0.1], [0.4, 0.5], [0.3, 0.1]),
        ("Head", [0.2, -0.1], 0.4, [0.2, -0.1]),
        (["HeadYaw", "HeadPitch"], [[0.3, 0.0], [0.1]], [[0.3, 0.6], [0.4]], [0.0, 0.1]),
        (["HeadYaw"], [[0.3, 0.2]], [[0.3, 0.5]], [0.2]),
    ],
)
def test_interpolation_takes_all_documented_forms_and_blocks(naoqi, names, angles, times, end):
    begin = time.monotonic()
    assert naoqi.ALMotion.angleInterpolation(names, angles, times, True) is None
    assert time.monotonic() - begin > 0.3
    assert naoqi.ALMotion.getAngles(names, True) == pytest.approx(end, abs=0.03)


def test_relative_interpolation_starts_where_the_joint_is(naoqi):
    motion = naoqi.ALMotion
    motion.angleInterpolation("HeadYaw", 0.3, 0.3, True)
    motion.angleInterpolation("HeadYaw", [0.2, -0.1], [0.3, 0.6], False)
    assert motion.getAngles("HeadYaw", True) == pytest.approx([0.2], abs=0.03)


def test_interpolation_with_speed_blocks_until_there(naoqi):
    motion = naoqi.ALMotion
    motion.angleInterpolationWithSpeed(["HeadYaw", "RElbowRoll"], [-0.6, 1.0], 0.5)
    assert motion.getAngles(["HeadYaw", "RElbowRoll"], True) == pytest.approx([-0.6, 1.0], abs=0.03)


def test_bezier_timelines_as_choregraphe_exports_them(naoqi):
    names = ["HeadYaw", "RShoulderPitch"]
    times = [[0.4, 0.8], [0.8]]
    keys = [
        [[0.3, [3, -0.13, 0.0], [3, 0.13, 0.0]], [0.1, [3, -0.13, 0.0], [3, 0.0, 0.0]]],
        [[1.2, [3, -0.26, 0.0], [3, 0.0, 0.0]]],
    ]
    naoqi.ALMotion.angleInterpolationBezier(names, times, keys)
    assert naoqi.ALMotion.getAngles(names, True) == pytest.approx([0.1, 1.2], abs=0.03)


def test_setting_an_angle_ends_an_interpolation(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.angleInterpolation("HeadYaw", 1.0, 5.0, True, _async=True)
    wait_until(lambda: any(task[0] == "angleInterpolation" for task in motion.getTaskList()), "the task is listed")
    motion.setAngles("HeadYaw", 0.0, 0.5)
    call.wait(3000)
    assert call.isFinished()
    assert motion.getTaskList() == []


def test_a_second_motion_of_a_joint_is_postponed(naoqi, wait_until):
    motion = naoqi.ALMotion
    first = motion.angleInterpolation(["HeadYaw", "HeadPitch"], [0.6, 0.2], 60.0, True, _async=True)
    wait_until(motion.getTaskList, "the first motion runs")
    second = motion.angleInterpolation("HeadPitch", 0.2, 0.2, False, _async=True)
    motion.ping()
    behind = motion.angleInterpolation(["HeadPitch", "LHand"], [0.3, 0.9], 0.4, True, _async=True)
    motion.angleInterpolation("RElbowRoll", 1.0, 0.2, True)  # another joint waits for nobody
    ((_, number, joints),) = motion.getTaskList()
    assert joints == ["HeadYaw", "HeadPitch"] and not second.isFinished() and not behind.isFinished()
    before = motion.getAngles("HeadPitch", False)[0]
    motion.killTask(number)
    second.wait(5000)
    assert first.isFinished() and not behind.isFinished()
    assert motion.getAngles("HeadPitch", False)[0] == pytest.approx(before + 0.2, abs=0.05)
    behind.wait(5000)
    assert motion.getAngles(["HeadPitch", "LHand"], True) == pytest.approx([0.3, 0.9], abs=0.03)


def test_what_is_postponed_ends_with_what_it_waits_for(naoqi, wait_until):
    motion, posture = naoqi.ALMotion, naoqi.ALRobotPosture
    running = motion.angleInterpolation("HeadYaw", 1.0, 60.0, True, _async=True)
    wait_until(motion.getTaskList, "the first motion runs")
    waiting = [posture.goToPosture("Crouch", 0.5, _async=True), motion.moveInit(_async=True)]
    cancelled = motion.angleInterpolation("HeadYaw", 0.5, 60.0, True, _async=True)
    cancelled.cancel()
    motion.killTasksUsingResources(["HeadYaw"])
    assert waiting[0].value(5000) is False
    for call in (running, waiting[1]):
        call.wait(5000)
        assert call.isFinished()
    assert motion.areResourcesAvailable(["Body"])


def test_a_motion_that_gives_way_does_not_make_others_wait(naoqi, simulation):
    joints = simulation.server.catalogue.services[2].joints
    alive = joints.follow("breathing", {"HeadYaw": [(60.0, 1.0)]}, yields=True)
    assert naoqi.ALMotion.areResourcesAvailable(["Head"])
    naoqi.ALMotion.angleInterpolation("HeadYaw", 0.2, 0.2, True)
    assert alive.result(0) is False
    assert naoqi.ALMotion.getAngles("HeadYaw", True) == pytest.approx([0.2], abs=0.03)


def test_hands_open_and_close(naoqi, refused):
    motion = naoqi.ALMotion
    motion.openHand("RHand")
    assert motion.getAngles("RHand", True)[0] > 0.9
    motion.closeHand("RHand")
    assert motion.getAngles("RHand", True)[0] < 0.1
    assert "handName" in refused(motion.openHand, "Foot")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("Tail", 0.1, 0.1), "Tail"),
        (([], 0.1, 0.1), "names"),
        ((5, 0.1, 0.1), "names"),
        (("Head", [0.1], 0.1), "angles"),
        (("Head", 0.1, 0.1), "angles"),
        (("HeadYaw", "left", 0.1), "angles"),
        (("HeadYaw", NAN, 0.1), "angles"),
        (("HeadYaw", 0.1, 1.5), "fractionMaxSpeed"),
        (("HeadYaw", 0.1, -0.1), "fractionMaxSpeed"),
        ((["HeadYaw"], [[0.1]], 0.1), "angles"),
        (("Head", [0.1, 0.1], [0.1, 2.0]), "fractionMaxSpeeds"),
    ],
)
def test_malformed_set_angles_are_refused(naoqi, refused, arguments, named):
    assert named in refused(naoqi.ALMotion.setAngles, *arguments)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("Head", 0.1, 1.0, True), "angleLists"),
        (("HeadYaw", [0.1, 0.2], [1.0], True), "timeLists"),
        (("HeadYaw", [0.1, 0.2], [2.0, 1.0], True), "times"),
        (("HeadYaw", 0.1, -1.0, True), "times"),
        (("HeadYaw", 0.1, NAN, True), "timeLists"),
        ((["HeadYaw", "HeadYaw"], [0.1, 0.2], 1.0, True), "twice"),
        (("HeadYaw", [], [], True), "angleLists"),
    ],
)
def test_malformed_interpolations_are_refused(naoqi, refused, arguments, named):
    assert named in refused(naoqi.ALMotion.angleInterpolation, *arguments)


def test_malformed_bezier_curves_are_refused(naoqi, refused):
    bezier = naoqi.ALMotion.angleInterpolationBezier
    assert "times" in refused(bezier, ["HeadYaw"], [], [])
    assert "controlPoints" in refused(bezier, ["HeadYaw"], [[1.0]], [[]])
    assert "handle" in refused(bezier, ["HeadYaw"], [[1.0]], [[[0.1, [3, 0.1]]]])
    assert "at most 3600 s" in refused(bezier, ["HeadYaw"], [[4e9]], [[0.1]]), "before it is sampled"
