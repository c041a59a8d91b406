"""Odometry that is set, or starts again, while the robot stays where it is. Times are invented."""

import math

import numpy as np
import pytest

from telepresence.safety import ROBOTINO, Command, Odometry, State, VelocityGate

PERIOD = 0.05
NOTHING = [0.41] * 9
QUARTER = 0.5 * math.pi


class Robot:
    """A gate and a robot that stays where it is."""

    def __init__(self, careful=False):
        self.gate = VelocityGate(ROBOTINO, careful=careful)
        self.now = 0.0
        self.pose = (0.0, 0.0, 0.0)

    def run(self, ticks, velocity, ranges=NOTHING, turning=0.0):
        for _ in range(ticks):
            self.now += PERIOD
            x, y, theta = self.pose
            self.pose = (x, y, theta + turning * PERIOD)
            self.gate.update_ranges("infrared", self.now, ranges)
            decision = self.gate.step(self.now, Command(*velocity, self.now), Odometry(*self.pose, self.now))
        return decision


def beside_two_beams(robot):
    """Let the robot see something 6 cm ahead, and turn until it lies between two beams. Return its bearing."""
    robot.pose = (1.0, 2.0, QUARTER)
    robot.run(10, (0.0, 0.0, 0.0), [0.06, *NOTHING[1:]])
    robot.run(7, (0.0, 0.0, -1.0), turning=-1.0)
    return 0.35


@pytest.mark.parametrize("jump", [QUARTER, -QUARTER, math.pi])
def test_forward_stays_forward_with_the_careful_scan_when_the_heading_jumps(jump):
    robot = Robot(careful=True)
    assert robot.run(40, (0.05, 0.0, 0.0)).vx == pytest.approx(0.05)
    robot.pose = (0.0, 0.0, robot.pose[2] + jump)
    decision = robot.run(1, (0.05, 0.0, 0.0))
    assert decision.state is State.FAULT and "jumped" in decision.reason and decision.speed == 0.0
    decision = robot.run(4, (0.05, 0.0, 0.0))
    assert decision.vx == pytest.approx(0.05, abs=0.005) and decision.vy == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("pose", [(1.0, 2.0, 0.0), (0.0, 0.0, 0.0), (5.0, 2.0, QUARTER - 0.35)])
def test_what_lies_between_two_beams_stays_beside_the_robot_when_odometry_jumps(pose):
    robot = Robot()
    bearing = beside_two_beams(robot)
    towards = (0.2 * math.cos(bearing), 0.2 * math.sin(bearing), 0.0)
    before = robot.gate.obstacles()
    slowed = robot.run(8, towards).speed
    assert slowed < 0.10
    robot.pose = pose
    assert "jumped" in robot.run(1, towards).reason
    assert robot.gate.obstacles() == pytest.approx(before, abs=0.01)
    for _ in range(12):
        decision = robot.run(1, towards)
        assert decision.speed < slowed + 0.01 and decision.state is not State.CLEAR


def test_turning_as_fast_as_the_base_can_is_no_jump():
    robot = Robot()
    decision = robot.run(40, (0.0, 0.0, 1.0), turning=3.4)
    assert decision.wz == pytest.approx(1.0)


def test_a_bump_stays_where_it_was_felt_when_the_heading_jumps():
    robot = Robot()
    robot.run(10, (0.1, 0.0, 0.0))
    robot.gate.update_bumper(robot.now, True)
    robot.gate.update_bumper(robot.now, False)
    robot.pose = (0.0, 0.0, QUARTER)
    robot.run(1, (0.0, 0.0, 0.0))
    assert robot.run(10, (0.1, 0.0, 0.0)).vx == pytest.approx(0.0, abs=1e-3)
    assert robot.run(10, (-0.1, 0.0, 0.0)).vx == pytest.approx(-0.1, abs=1e-3)


def test_odometry_that_starts_again_is_told_and_everything_remembered_goes():
    robot = Robot()
    beside_two_beams(robot)
    assert len(robot.gate.obstacles())
    robot.gate.forget_surroundings()
    decision = robot.run(1, (0.1, 0.0, 0.0))
    assert decision.speed == 0.0 and "seen anew" in decision.reason
    assert not len(robot.gate.obstacles())
    assert robot.run(10, (0.1, 0.0, 0.0)).vx == pytest.approx(0.1)


def test_after_a_longer_time_a_jump_may_be_the_robots_own_way():
    robot = Robot()
    beside_two_beams(robot)
    robot.now += 0.4
    robot.pose = (3.0, 2.0, 0.0)
    assert "jumped" in robot.run(1, (0.1, 0.0, 0.0)).reason
    assert not len(np.atleast_2d(robot.gate.obstacles()))
