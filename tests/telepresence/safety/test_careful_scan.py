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
SIGHT, REACTION, BRAKING = 0.36, 0.20, 0.35


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
        return self.swing.fastest(SIGHT, REACTION, BRAKING)


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
    assert quick.fastest() > ROBOTINO.limits.max_speed > 0.19 > slow.fastest() > 0.12


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


def test_the_pilot_is_told_why_it_is_slower_until_the_scan_has_looked():
    gate = VelocityGate(ROBOTINO, careful=True)
    for number in range(1, 20):
        now = TICK * number
        gate.update_ranges("infrared", now, [0.41 + 0.001 * (number % 3)] * 9)
        decision = gate.step(now, Command(0.2, 0.0, 0.0, now), Odometry(0.0, 0.0, 0.0, now))
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
