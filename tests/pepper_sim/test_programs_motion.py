"""Programs that move the robot, run unchanged; what they did is seen in the world."""

import math
import threading
from itertools import pairwise

import pytest


class Watcher(threading.Thread):
    """Keeps what the robot's joints did while a program ran."""

    def __init__(self, robot):
        super().__init__()
        self._robot, self._over = robot, threading.Event()
        self.seen = []

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self.join()

    def run(self):
        while not self._over.wait(0.02):
            self.seen.append(self._robot.snapshot().joint_positions)

    def of(self, joint):
        return [angles[joint] for angles in self.seen]


def test_the_second_motion_of_a_joint_waits_for_the_first(naoqi, run_against_robot):
    with Watcher(naoqi.robot) as watcher:
        printed = run_against_robot("motion_postponed", "--seconds", 2.5)
    assert "head free: False" in printed and "waiting: True" in printed
    # The second one has begun when the program comes to ask where the first has ended.
    assert "first ended at" in printed and "second ended at -0.8" in printed
    assert max(watcher.of("HeadYaw")) == pytest.approx(0.8, abs=0.03)
    assert naoqi.robot.snapshot().joint_positions["HeadYaw"] == pytest.approx(-0.8, abs=0.03)


def test_killing_the_first_motion_lets_the_second_start(naoqi, run_against_robot):
    with Watcher(naoqi.robot) as watcher:
        printed = run_against_robot("motion_postponed", "--seconds", 60.0, "--kill")
    assert "killing angleInterpolation True" in printed
    assert max(watcher.of("HeadYaw")) < 0.1 and min(watcher.of("HeadYaw")) == pytest.approx(-0.8, abs=0.03)


def test_a_limp_arm_is_led_by_hand(naoqi, run_against_robot):
    with Watcher(naoqi.robot) as watcher:
        printed = run_against_robot("motion_teach")
    learned = [float(word) for word in printed.split("learned:")[1].split()]
    joints = naoqi.ALMotion.getBodyNames("LArm")
    angles = naoqi.robot.snapshot().joint_positions
    assert [angles[joint] for joint in joints] == pytest.approx(learned, abs=0.05)
    assert min(watcher.of("LShoulderPitch")) > 0.0, "limp, it was not lifted to -1"
    assert min(watcher.of("LShoulderPitch")) < 1.0, "stiff again, it was stretched"
    assert naoqi.ALMotion.getStiffnesses("LArm") == [1.0] * 6


def test_a_square(naoqi, run_against_robot):
    assert "error: 0.0" in run_against_robot("motion_square", "--side", 0.2)
    x, y, _, _, _, theta = naoqi.robot.truth()
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.06) and abs(math.remainder(theta, math.tau)) < 0.1


def test_an_exported_timeline(naoqi, run_against_robot):
    with Watcher(naoqi.robot) as watcher:
        hand, posture = run_against_robot("motion_timeline", "--rest").splitlines()
    assert float(hand.removeprefix("hand: ")) > 0.95 and posture == "True Standing"
    assert min(watcher.of("RShoulderPitch")) == pytest.approx(-0.4, abs=0.05)
    turns = [angle < 0.7 for angle in watcher.of("RElbowRoll")]
    assert sum(now and not before for before, now in pairwise(turns)) >= 2, "it waved"
    assert set(naoqi.robot.snapshot().stiffness.values()) == {0.0} and not naoqi.ALMotion.robotIsWakeUp()


def test_breathing_keeps_the_balance(naoqi, run_against_robot):
    stable, moved, place, reason = run_against_robot("motion_balance", "--seconds", 2.0).splitlines()
    assert stable == "stable: True of 28.7 kg"
    assert 0.005 < float(moved.split()[2]) < 0.1
    assert "ALMotion::setPositions" in place and "not available on this robot" in reason
    assert not naoqi.ALMotion.getBreathEnabled("Body")
