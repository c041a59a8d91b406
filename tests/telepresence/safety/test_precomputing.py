"""`VelocityGate.precompute` does the work of a tick before the command comes, and changes no decision."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from telepresence.safety import PEPPER, ROBOTINO, Command, Odometry, State, VelocityGate

PERIOD = 0.05
SENSED = 0.03
"""Readings come this long before the tick [s]."""


class Robot:
    """One that follows at once, in front of a wall unless stated otherwise; `precomputes` says what its gate does."""

    def __init__(self, precomputes, profile=ROBOTINO, wall=1.0):
        self.gate = VelocityGate(profile)
        self.precomputes, self.wall = precomputes, wall
        self.now = self.x = 0.0
        self.noise = np.random.default_rng(1)

    def sense(self, x=None):
        self.odometry = Odometry(self.x if x is None else x, 0.0, 0.0, self.now + PERIOD - SENSED)
        stamp = self.odometry.stamp
        for source in self.gate.profile.sources:
            ahead = source.directions[:, 0] > 0.9
            place = (self.wall - self.x - source.origins[:, 0]) / np.where(ahead, source.directions[:, 0], 1.0)
            ranges = np.where(ahead, place + 0.001 * self.noise.standard_normal(source.beams), source.max_range)
            self.gate.update_ranges(source.name, stamp, np.clip(ranges, source.min_range + 0.01, source.max_range))
        if self.precomputes:
            self.gate.precompute(stamp, self.odometry)

    def tick(self, *velocity):
        self.now += PERIOD
        decision = self.gate.step(self.now, Command(*velocity, self.now), self.odometry)
        self.x += decision.vx * PERIOD
        return decision

    def run(self, seconds, *velocity):
        for _ in range(round(seconds / PERIOD)):
            self.sense()
            decision = self.tick(*velocity)
        return decision


commands = st.lists(st.tuples(*[st.sampled_from([-0.3, 0.0, 0.1, 0.3])] * 3), min_size=1, max_size=25)


@given(st.sampled_from([ROBOTINO, PEPPER]), st.floats(0.4, 2.0), commands)
@settings(max_examples=15)
def test_the_decisions_are_the_same_as_without(profile, wall, velocities):
    with_look, without = Robot(True, profile, wall), Robot(False, profile, wall)
    for velocity in velocities:
        with_look.sense()
        without.sense()
        ours, theirs = with_look.tick(*velocity), without.tick(*velocity)
        assert (ours.vx, ours.vy, ours.wz, ours.state) == (theirs.vx, theirs.vy, theirs.wz, theirs.state)
        assert np.array_equal(ours.allowed, theirs.allowed)


def test_the_surroundings_are_not_computed_twice(monkeypatch):
    robot = Robot(True)
    robot.run(0.5, 0.1, 0.0, 0.0)
    robot.sense()
    monkeypatch.setattr("telepresence.safety.gate.TickState", None)  # whoever makes one fails
    assert robot.tick(0.1, 0.0, 0.0).vx > 0.0


def test_what_was_seen_long_ago_is_not_relied_on():
    """A sensor that falls silent right after a look is noticed a tick later at most."""
    impatient = replace(ROBOTINO, limits=replace(ROBOTINO.limits, sensor_timeout=0.2))  # less than for odometry
    for precomputes in (True, False):
        robot = Robot(precomputes, impatient, wall=10.0)
        robot.run(1.0, 0.1, 0.0, 0.0)
        begun, decision = robot.now - SENSED, None
        while decision is None or decision.vx > 0.0:
            decision = robot.tick(0.1, 0.0, 0.0)
            assert robot.now - begun <= 0.2 + 2 * PERIOD
        assert decision.state is State.SENSOR_STALE


def test_a_bump_after_a_look_counts_at_once():
    robot = Robot(True, wall=10.0)
    robot.run(1.0, 0.1, 0.0, 0.0)
    robot.sense()
    robot.gate.update_bumper(robot.now, True, 0.0)
    decision = robot.tick(0.1, 0.0, 0.0)
    assert decision.state is State.BUMPED and decision.vx == 0.0
    robot.sense()
    robot.gate.update_bumper(robot.now, False)
    assert robot.gate.reset_bumper()
    assert robot.tick(-0.1, 0.0, 0.0).state is not State.BUMPED


def test_a_jump_that_a_look_has_found_stops_the_robot_at_the_next_tick():
    robot = Robot(True, wall=10.0)
    robot.run(1.0, 0.1, 0.0, 0.0)
    robot.sense(x=3.0)
    decision = robot.tick(0.1, 0.0, 0.0)
    assert decision.state is State.FAULT and "jumped" in decision.reason


def test_looking_a_little_later_than_the_next_tick_is_no_clock_that_goes_back():
    """Two threads read the clock, and then wait for one another."""
    robot = Robot(True, wall=10.0)
    robot.run(1.0, 0.1, 0.0, 0.0)
    robot.sense()
    robot.gate.precompute(robot.now + PERIOD + 0.001, robot.odometry)
    assert robot.tick(0.1, 0.0, 0.0).vx > 0.0
    robot.gate.precompute(robot.now - 0.001, robot.odometry)
    assert robot.tick(0.1, 0.0, 0.0).vx > 0.0


def test_neither_a_missing_pose_nor_a_clock_without_time_is_looked_at():
    robot = Robot(True)
    robot.gate.precompute(math.nan, Odometry(0.0, 0.0, 0.0, 1.0))
    robot.gate.precompute(1.0, None)
    assert robot.gate.step(1.05, Command(0.1, 0.0, 0.0, 1.05), None).state is State.FAULT
