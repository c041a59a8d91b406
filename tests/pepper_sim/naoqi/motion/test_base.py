"""ALMotion's driving over the wire, checked against where the robot really is."""

import math
import time

import pytest

NAN, INF = float("nan"), float("inf")


def _pose(naoqi):
    x, y, _, _, _, theta = naoqi.robot.truth()
    return x, y, theta


def _moved(naoqi, start):
    x, y, theta = _pose(naoqi)
    c, s = math.cos(start[2]), math.sin(start[2])
    dx, dy = x - start[0], y - start[1]
    return dx * c + dy * s, dy * c - dx * s, math.remainder(theta - start[2], math.tau)


def _settles_at(motion, wait_until, velocity, tolerance=0.01):
    """Wait until that is the velocity, and it no longer changes. The world may stand still for a moment at any other
    one, on a busy machine."""
    before = [math.inf] * 3

    def settled():
        nonlocal before
        time.sleep(0.15)
        last, before = before, motion.getRobotVelocity()
        return before == pytest.approx(last, abs=1e-3) and before == pytest.approx(velocity, abs=tolerance)

    wait_until(settled, f"the velocity settles at {velocity}")


def test_move_to_arrives_and_answers_true(naoqi, wait_until):
    start = _pose(naoqi)
    assert naoqi.ALMotion.moveTo(0.4, 0.2, 0.5) is True
    assert _moved(naoqi, start) == pytest.approx((0.4, 0.2, 0.5), abs=0.03)
    assert naoqi.ALMotion.getRobotPosition(True) == pytest.approx([0.4, 0.2, 0.5], abs=0.02)
    wait_until(lambda: not naoqi.ALMotion.moveIsActive(), "the robot stands")


def test_move_holds_in_metres_per_second_until_stopped(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.move(0.2, 0.0, 0.0)
    _settles_at(motion, wait_until, [0.2, 0.0, 0.0])
    assert motion.moveIsActive()
    assert motion.stopMove() is True
    assert motion.getRobotVelocity() == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)
    assert not motion.moveIsActive()


def test_a_move_does_not_wait_for_the_world_and_whoever_does_sees_it(naoqi, wait_until):
    with naoqi.robot.world.locked():
        naoqi.ALMotion.move(0.2, 0.0, 0.0)
        asked = naoqi.ALMotion.moveIsActive(_async=True)
        assert naoqi.ALSystem.ping()
        assert asked.isRunning()
    assert asked.value(10_000)
    wait_until(lambda: naoqi.ALMotion.getRobotVelocity()[0] > 0.1, "it drives")
    with naoqi.robot.world.locked():
        naoqi.ALMotion.move(-0.2, 0.0, 0.0)
        stopping = naoqi.ALMotion.stopMove(_async=True)
        assert naoqi.ALSystem.ping()
    assert stopping.value(10_000)
    assert not naoqi.ALMotion.moveIsActive(), "what was ordered before the stop does not come after it"


def test_move_toward_takes_fractions_of_top_speed(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.moveToward(0.5, 0.0, -0.25)
    _settles_at(motion, wait_until, [0.175, 0.0, -0.25])
    motion.moveToward(0.0, 0.0, 1.0, [["MaxVelTheta", 0.4]])
    wait_until(lambda: motion.getRobotVelocity()[2] > 0.0, "the robot turns the other way")
    _settles_at(motion, wait_until, [0.0, 0.0, 0.4])
    motion.moveToward(0.0, 0.0, 0.0)
    wait_until(lambda: not motion.moveIsActive(), "the robot stands")


def test_speeds_are_cut_to_the_limits_and_a_config_changes_them(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.move(0.0, 0.0, 9.0)
    _settles_at(motion, wait_until, [0.0, 0.0, 1.0], 0.005)
    motion.move(0.0, 0.0, 9.0, [["MaxVelTheta", 0.3], ["Frequency", 1.0]])
    wait_until(lambda: motion.getRobotVelocity()[2] < 0.31, "the robot slows down")
    _settles_at(motion, wait_until, [0.0, 0.0, 0.3], 0.005)
    motion.stopMove()


def test_stop_ends_a_move_that_is_under_way(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.moveTo(1.0, 0.0, 0.0, _async=True)
    wait_until(motion.moveIsActive, "the robot moves")
    motion.stopMove()
    assert call.value(5000) is False


def test_a_stop_is_answered_although_another_client_drives_on(naoqi, wait_until, insist):
    motion = naoqi.ALMotion
    insist("move", 0.0, 0.0, 0.5)
    wait_until(lambda: motion.getRobotVelocity()[2] > 0.4, "the robot turns")
    assert motion.stopMove(_async=True).value(10_000) is False
    wait_until(lambda: motion.getRobotVelocity()[2] > 0.4, "the robot turns on")


def test_a_new_command_ends_a_move(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.moveTo(1.0, 0.0, 0.0, _async=True)
    wait_until(motion.moveIsActive, "the robot moves")
    motion.move(0.0, 0.0, 0.2)
    assert call.value(5000) is False
    motion.stopMove()


def test_cancelling_the_call_stops_the_robot(naoqi, wait_until):
    motion = naoqi.ALMotion
    call = motion.moveTo(1.0, 0.0, 0.0, _async=True)
    wait_until(motion.moveIsActive, "the robot moves")
    call.cancel()
    wait_until(lambda: not motion.moveIsActive(), "the robot stands")


def test_paths_are_relative_point_by_point(naoqi):
    start = _pose(naoqi)
    assert naoqi.ALMotion.moveTo([[0.1, 0.0, math.pi / 4], [0.1, 0.0, 0.0]]) is True
    diagonal = 0.1 * math.sqrt(0.5)
    assert _moved(naoqi, start) == pytest.approx((0.1 + diagonal, diagonal, math.pi / 4), abs=0.03)


def test_a_move_in_a_given_time_takes_it(naoqi):
    begin = time.monotonic()
    assert naoqi.ALMotion.moveTo(0.1, 0.0, 0.0, 2.0) is True
    assert time.monotonic() - begin > 1.7


def test_waiting_for_the_end_of_a_move(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.moveTo(0.15, 0.0, 0.0, _async=True)
    wait_until(motion.moveIsActive, "the robot moves")
    motion.waitUntilMoveIsFinished()
    assert not motion.moveIsActive()


def test_a_sleeping_robot_does_not_move_and_says_why(naoqi, wait_until):
    motion = naoqi.ALMotion
    failures = []
    subscriber = naoqi.ALMemory.subscriber("ALMotion/MoveFailed")
    subscriber.signal.connect(failures.append)
    motion.rest()
    start = _pose(naoqi)
    assert motion.moveTo(0.3, 0.0, 0.0) is False
    motion.move(0.3, 0.0, 0.0)
    wait_until(lambda: len(failures) >= 1, "the refusal was reported")
    assert failures[0][0] == "stiffness" and failures[0][1] == 0
    assert _moved(naoqi, start) == pytest.approx((0, 0, 0), abs=0.005)
    motion.wakeUp()


def test_move_config_tables(naoqi, refused):
    motion = naoqi.ALMotion
    assert dict(motion.getMoveConfig("Default"))["MaxVelXY"] == pytest.approx(0.35)
    assert dict(motion.getMoveConfig("Max"))["MaxAccXY"] == pytest.approx(0.55)
    assert dict(motion.getMoveConfig("Min"))["MaxVelTheta"] == pytest.approx(0.2)
    assert "config" in refused(motion.getMoveConfig, "Fast")


@pytest.mark.parametrize("value", [NAN, INF, -INF])
def test_numbers_that_are_not_finite_are_refused(naoqi, refused, value):
    motion = naoqi.ALMotion
    assert "controlPoint" in refused(motion.moveTo, [[0.1, value, 0.0]])
    texts = [refused(motion.move, 0.0, value, 0.0), refused(motion.moveTo, value, 0.0, 0.0)]
    refused(motion.moveToward, 0.0, 0.0, value)
    if value != value:  # libqi itself refuses infinity where there are overloads, with words of its own
        assert "y must be a finite number" in texts[0] and "x must be a finite number" in texts[1]
    assert not motion.moveIsActive()


def test_malformed_commands_are_refused(naoqi, refused):
    motion = naoqi.ALMotion
    assert "x must be a number" in refused(motion.move, "fast", 0.0, 0.0)
    assert "moveConfig" in refused(motion.move, 0.1, 0.0, 0.0, [["Warp", 9.0]])
    assert "moveConfig" in refused(motion.move, 0.1, 0.0, 0.0, "fast")
    assert "controlPoint" in refused(motion.moveTo, [[1.0, 2.0]])
    assert "controlPoint" in refused(motion.moveTo, [])
    assert "time" in refused(motion.moveTo, 0.1, 0.0, 0.0, -1.0)
    refused(motion.move, 0.1)
    assert not motion.moveIsActive()


def test_old_names_still_drive(naoqi, wait_until):
    motion = naoqi.ALMotion
    motion.setWalkTargetVelocity(0.0, 0.0, 0.3, 1.0)
    wait_until(motion.walkIsActive, "the robot moves")
    assert motion.stopWalk() is True
    assert motion.walkTo(0.05, 0.0, 0.0) is True


def test_arm_switches_are_kept(naoqi, refused):
    motion = naoqi.ALMotion
    motion.setMoveArmsEnabled(True, False)
    assert [motion.getMoveArmsEnabled(name) for name in ("LArm", "RArm", "Arms")] == [True, False, False]
    assert "chainName" in refused(motion.getMoveArmsEnabled, "Tail")
    motion.setMoveArmsEnabled(True, True)
