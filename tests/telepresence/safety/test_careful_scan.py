"""The swing of the careful scan: how far, how fast, and how fast the robot may drive meanwhile."""

import math
from collections import deque

import pytest

from telepresence.safety import ROBOTINO, Command, Odometry, State, VelocityGate
from telepresence.safety.careful_scan import BodySwing

TICK = 0.05
QUICK = dict(late=2, rising=3.14, falling=3.14)
"""A Robotino as its own configuration has it; `late` in ticks, the rest in rad/s²."""
SLOW = dict(late=5, rising=0.919, falling=2.67)
"""One over Wi-Fi, as a lab has measured it (hsbi-robotino-navigation, motion.yaml: 0.216 s)."""
LIMITS = ROBOTINO.limits
SIGHT = 0.40 - LIMITS.margin_ahead
"""[m]"""


class Body:
    """A body that turns as it is told, late and with a ramp."""

    def __init__(self, late, rising, falling):
        self.swing = BodySwing(ROBOTINO.swing)
        self.rising, self.falling = rising, falling
        self.told = deque([0.0] * late, maxlen=late)
        self.now = self.theta = self.rate = 0.0

    def drive(self, seconds, wanted=True):
        """Return the headings of this time [rad]."""
        headings = []
        for _ in range(round(seconds / TICK)):
            self.now += TICK
            self.swing.look(self.now, self.theta)
            target, told = self.told[0], self.swing.rate(self.theta, 0.0, wanted, TICK)
            self.told.append(told)
            step = TICK * (self.falling if (target - self.rate) * self.rate < 0.0 else self.rising)
            self.rate += max(-step, min(step, target - self.rate))
            self.theta += TICK * self.rate
            headings.append(self.theta)
        return headings

    def fastest(self):
        return self.swing.fastest(SIGHT, LIMITS.reaction, LIMITS.braking)


@pytest.mark.parametrize("dynamics", [QUICK, SLOW], ids=["quick", "slow"])
def test_the_swing_covers_the_gap_between_two_beams_and_no_more_and_comes_home(dynamics):
    body = Body(**dynamics)
    body.drive(6.0)
    headings = body.drive(6.0)
    for widest in (max(headings), -min(headings)):
        assert math.radians(20.0) < widest < math.radians(30.0)
    body.drive(5.0, wanted=False)
    assert abs(body.theta) < 0.05


def test_a_robot_drives_no_faster_than_its_body_looks_from_side_to_side():
    quick, slow = Body(**QUICK), Body(**SLOW)
    quick.drive(6.0)
    slow.drive(6.0)
    assert quick.fastest() > LIMITS.max_speed > 0.19 > slow.fastest() > 0.12


def test_a_robot_drives_slower_until_its_body_has_looked_to_both_sides():
    body = Body(**QUICK)
    body.drive(6.0)
    at_first = Body(**QUICK)
    assert at_first.fastest() < 0.17, "nothing is known of the body yet"
    body.drive(5.0, wanted=False)
    started = body.fastest()
    body.drive(3.0)
    assert started < 0.19 < body.fastest()


def test_turning_for_another_reason_is_looking_too():
    body = Body(**QUICK)
    body.drive(6.0)
    body.drive(5.0, wanted=False)
    slow = body.fastest()
    for tick in range(40):
        body.swing.look(body.now + TICK * tick, body.theta + 0.03 * tick)
    assert body.fastest() > slow
    body.swing.forget_surroundings()
    assert body.fastest() == slow


def test_a_body_that_cannot_turn_slows_the_robot():
    body = Body(**QUICK)
    body.drive(6.0)
    before = body.fastest()
    body.rising = body.falling = 0.0
    body.rate = 0.0
    body.drive(6.0)
    assert body.fastest() < 0.5 * before


class Drive:
    """A gate whose sensors see nothing, and a body that turns when the test says so."""

    def __init__(self):
        self.gate = VelocityGate(ROBOTINO, careful=True)
        self.ticks, self.began, self.theta = 0, 0.0, 0.0

    def go(self, ticks, turning=0.0, silent=False):
        """Go on at full speed; `turning` rad in each tick. Return the last decision."""
        for _ in range(ticks):
            self.ticks += 1
            self.theta += turning
            now = self.began + TICK * self.ticks
            if not silent:
                self.gate.update_ranges("infrared", now, [0.41 + 0.001 * (self.ticks % 3)] * 9)
            decision = self.gate.step(now, Command(0.2, 0.0, 0.0, now), Odometry(0.0, 0.0, self.theta, now))
        return decision


def test_what_the_body_turns_while_the_sensors_are_silent_is_no_looking():
    turned, stood = Drive(), Drive()
    for drive, turning in ((turned, 0.025), (stood, 0.0)):
        drive.go(20)
        assert drive.go(40, turning, silent=True).state is State.SENSOR_STALE
    assert turned.go(12).speed == stood.go(12).speed > 0.05


def test_what_was_looked_at_before_the_clock_went_back_does_not_count():
    drive, fresh = Drive(), Drive()
    drive.began = 5000.0
    drive.go(40, 0.03)
    drive.began -= 4000.0
    assert drive.go(1).state is State.FAULT
    assert drive.go(12).speed == fresh.go(12).speed > 0.05


def test_the_pilot_is_told_why_it_is_slower_until_the_scan_has_looked():
    decision = Drive().go(20)
    assert decision.speed < 0.17 and decision.state is State.LIMITED
    assert decision.reason == f"Slowed to {decision.speed:.2f} m/s: the careful scan must have looked there first."


def test_a_body_that_swings_stands_as_soon_as_nothing_is_asked_of_it():
    """Turning back to the pilot's heading took a second; a robot whose pilot is lost must stand within half of one."""
    gate, theta, rate, number = VelocityGate(ROBOTINO, careful=True), 0.0, 0.0, 0

    def tick(vx):
        nonlocal theta, rate, number
        number += 1
        now = 0.05 * number
        gate.update_ranges("infrared", now, [0.41 + 0.001 * (number % 3)] * 9)
        decision = gate.step(now, Command(vx, 0.0, 0.0, now), Odometry(0.0, 0.0, theta, now))
        rate += max(-0.15, min(0.15, decision.wz - rate))  # 3 rad/s2, as the base takes
        theta += 0.05 * rate
        return decision

    while abs(tick(0.1).swing) < math.radians(10.0):
        assert number < 200, "it swings"
    for _ in range(20):
        decision = tick(0.0)
        assert (decision.vx, decision.vy, decision.wz) == (0.0, 0.0, 0.0)
    decision = tick(0.1)
    towards = math.atan2(decision.vy, decision.vx) + theta
    assert abs(theta) > math.radians(5.0) and abs(towards) < math.radians(1.0), "the pilot's direction has stayed"
