"""Which inputs are recent, what is latched, what the pilot is shown. Times are invented."""

import math

import numpy as np
import pytest

from telepresence.safety import ROBOTINO, Command, Health, Odometry, State, VelocityGate
from telepresence.safety.gate_state import HOLD, GateStateFilter
from telepresence.safety.latches import BumperLatch, StopLatch
from telepresence.safety.timeouts import CommandTimeout

PERIOD = 0.05
LIMITS = ROBOTINO.limits


class Robot:
    """The gate and a Robotino that follows at once, in empty space unless stated otherwise."""

    def __init__(self):
        self.gate = VelocityGate(ROBOTINO)
        self.now = self.x = 0.0
        self.ranges = lambda: [0.41] * 9

    def tick(self, vx=0.1, stamp=None, clock=None):
        self.now += PERIOD
        now = self.now if clock is None else clock
        ranges = self.ranges()
        if ranges is not None:
            self.gate.update_ranges("infrared", now, ranges)
        command = None if vx is None else Command(vx, 0.0, 0.0, now if stamp is None else stamp)
        decision = self.gate.step(now, command, Odometry(self.x, 0.0, 0.0, now))
        self.x += decision.vx * PERIOD
        return decision

    def run(self, seconds, vx=0.1):
        for _ in range(round(seconds / PERIOD)):
            decision = self.tick(vx)
        return decision


def test_a_command_is_obeyed_until_it_times_out():
    timeout = CommandTimeout(LIMITS)
    assert timeout.current(0.0) is None and timeout.problem == "No command yet."
    command = Command(0.1, 0.0, 0.0, 1.0)
    assert timeout.offer(1.0, command) and timeout.current(0.99 + LIMITS.command_timeout) is command
    timeout.offer(1.31, command)  # the same object again is no news
    assert timeout.current(1.31) is None and "No command for 0.3 s" in timeout.problem


@pytest.mark.parametrize(("stamp", "words"), [(9.4, "0.6 s late"), (10.2, "in the future")])
def test_a_command_that_waited_in_a_queue_or_comes_from_another_clock_is_refused(stamp, words):
    timeout = CommandTimeout(LIMITS)
    timeout.offer(10.0, Command(0.1, 0.0, 0.0, stamp))
    assert timeout.current(10.0) is None and words in timeout.problem


def test_an_older_command_does_not_replace_a_newer():
    timeout = CommandTimeout(LIMITS)
    newer = Command(0.1, 0.0, 0.0, 1.0)
    timeout.offer(1.0, newer)
    timeout.offer(1.0, Command(-0.1, 0.0, 0.0, 0.9))
    assert timeout.current(1.0) is newer


def test_a_silent_sensor_stops_the_robot_and_its_return_lets_it_go():
    robot = Robot()
    assert robot.run(1.0).vx == pytest.approx(0.1)
    robot.ranges = lambda: None
    decision = robot.run(LIMITS.sensor_timeout + 0.1)
    assert decision.vx == 0.0 and decision.state is State.SENSOR_STALE and "infrared is silent" in decision.reason
    assert robot.gate.health(robot.now)["infrared"] is Health.SILENT
    robot.ranges = lambda: [0.41] * 9
    assert robot.run(1.0).vx == pytest.approx(0.1)


def test_readings_that_repeat_themselves_while_the_robot_moves_are_frozen():
    robot = Robot()
    robot.ranges = lambda: [0.41, 0.41, 0.25, 0.41, 0.41, 0.41, 0.41, 0.41, 0.41]
    decision = robot.run(2.5)
    assert decision.vx == 0.0 and "repeats itself" in decision.reason
    noise = np.random.default_rng(1)
    robot.ranges = lambda: [0.41, 0.41, 0.25 + 0.01 * noise.standard_normal(), *[0.41] * 6]
    assert robot.run(1.0).vx > 0.05


def test_unknown_beams_are_neither_near_nor_free():
    robot = Robot()
    robot.ranges = lambda: [-1.0] * 9
    decision = robot.run(1.0)
    assert decision.vx == 0.0 and decision.state is State.SENSOR_STALE


@pytest.mark.parametrize("ranges", [[0.41] * 8, [0.41] * 10, []])
def test_a_scan_of_the_wrong_length_is_refused(ranges):
    assert not VelocityGate(ROBOTINO).update_ranges("infrared", 0.0, ranges)


def test_a_clock_that_goes_back_stops_the_robot_for_a_moment():
    robot = Robot()
    robot.run(1.0)
    decision = robot.tick(clock=robot.now - 5.0)
    assert decision.vx == 0.0 and decision.state is State.FAULT and "clock went back" in decision.reason


def test_odometry_that_jumps_stops_the_robot_for_a_moment():
    robot = Robot()
    robot.run(1.0)
    robot.x += 3.0
    decision = robot.tick()
    assert decision.vx == 0.0 and "jumped" in decision.reason
    assert robot.run(1.0).vx == pytest.approx(0.1)


def test_a_stop_holds_until_reset_and_until_the_keys_are_released():
    robot = Robot()
    robot.run(1.0)
    robot.gate.stop("red button")
    assert robot.run(0.2).reason == "Stopped: red button. Reset to go on."
    robot.gate.reset_stop()
    assert robot.run(0.2).state is State.STOPPED
    robot.run(0.1, 0.0)
    assert robot.run(1.0).vx == pytest.approx(0.1)


def test_a_bump_leaves_only_the_slow_way_back_until_reset():
    robot = Robot()
    robot.run(1.0, 0.2)
    robot.gate.update_bumper(robot.now, True)
    assert robot.run(0.2, 0.2).vx == 0.0
    assert not robot.gate.reset_bumper()
    decision = robot.run(1.0, -0.2)
    assert decision.vx == pytest.approx(-LIMITS.escape_speed) and decision.state is State.BUMPED
    robot.gate.update_bumper(robot.now, False)
    assert robot.gate.reset_bumper()
    assert robot.run(1.0, -0.2).vx == pytest.approx(-0.2)


def test_latches_alone():
    stop, bumper = StopLatch(), BumperLatch()
    assert not stop.holds
    stop.set("")
    assert stop.holds and "stop pressed" in stop.message
    bumper.press(0.5 * math.pi)
    assert bumper.normal(0.5 * math.pi) == pytest.approx((1.0, 0.0))
    assert not bumper.reset()
    bumper.release()
    assert bumper.reset() and bumper.normal(0.0) is None


def test_worse_states_show_at_once_and_better_ones_after_a_while():
    state = GateStateFilter()
    assert state.update(0.0, 0.2, 0.2) is State.CLEAR
    assert state.update(0.1, 0.2, 0.1) is State.LIMITED
    assert state.update(0.2, 0.2, 0.0) is State.BLOCKED
    assert state.update(0.3, 0.2, 0.2) is State.BLOCKED
    assert state.update(0.3 + HOLD, 0.2, 0.2) is State.CLEAR
