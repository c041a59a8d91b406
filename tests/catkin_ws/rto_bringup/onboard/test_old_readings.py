"""A web server that lives on while the robot behind it has died: it repeats its last answers, which look fresh."""

from __future__ import annotations

import json
import math
import time

import pytest
from corrupting_proxy import CorruptingProxy
from rto_bringup.onboard.robotino_base import RobotinoBase
from rto_bringup.onboard.sensors import Reading
from rto_node.reading_count import FROZEN_AFTER, ReadingCount

from telepresence.drive.pilots import PilotVelocity
from telepresence.drive.server import AT_REST
from telepresence.safety import Odometry
from telepresence.safety.gate import ODOMETRY_MAX_AGE

PERIOD = 0.05
ODOMETRY, VELOCITY = "/data/odometry", "/data/omnidrive"
FREE = (0.41,) * 9


class Driving:
    """A pilot whose commands come in time."""

    cut, careful = False, False

    def deadline(self) -> float:
        return math.inf


def test_the_count_shows_whether_the_robot_lives():
    count = ReadingCount()
    assert not count.take(7, 0.0) and count.stamp == -math.inf, "one answer shows nothing"
    assert count.take(8, 0.05) and count.stamp == 0.05
    assert not count.take(8, 0.1) and count.stamp == 0.05, "a poll between two readings"
    assert count.take(10, 0.15) and count.take(0, 0.2), "a robot that was started again counts too"
    assert not count.problem(0.2 + FROZEN_AFTER)
    assert "repeats old values" in count.problem(0.21 + FROZEN_AFTER)
    assert count.take(1, 1.0) and not count.problem(1.0)


def test_a_robot_whose_odometry_has_never_counted_is_old_from_the_beginning():
    count = ReadingCount()
    count.take(7, 0.0)
    assert count.problem(0.01 + FROZEN_AFTER)


def test_the_wheels_get_zeros_once_odometry_is_as_old_as_its_count(monkeypatch):
    base = RobotinoBase("127.0.0.1:1", laser=False)
    monkeypatch.setattr(base, "_write", lambda _velocity: None)
    base._sensors.problem = ""
    counted, now = Odometry(0.0, 0.0, 0.0, 10.0), 10.0
    while now < 12.0:
        now += PERIOD
        counted = Odometry(0.0, 0.0, 0.0, now) if now < 11.0 else counted
        base._store(Reading(now, FREE, False, counted, None))
        outcome = base.step(now, PilotVelocity(0.2, 0.0, 0.0, now), None, Driving())
        age = now - counted.stamp
        if age > ODOMETRY_MAX_AGE + 0.01:
            assert outcome.given == AT_REST and outcome.state == "fault"
        elif now > 10.5 and age < ODOMETRY_MAX_AGE - 0.01:
            assert outcome.given[0] > 0.15


def test_a_robot_whose_odometry_starts_again_is_told_to_look_anew(monkeypatch):
    count = ReadingCount()
    for seq in (8, 9, 10):
        count.take(seq, 0.05 * seq)
    assert count.restarts == 0
    base = RobotinoBase("127.0.0.1:1", laser=False)
    monkeypatch.setattr(base, "_write", lambda _velocity: None)
    base._sensors.problem = ""

    def step(seq, ranges):
        now = 10.0 + 0.05 * step.ticks
        step.ticks += 1
        count.take(seq, now)
        base._store(Reading(now, ranges, False, Odometry(0.0, 0.0, 0.0, now), None, count.restarts))
        return base.step(now, PilotVelocity(0.1, 0.0, 0.0, now), None, Driving())

    step.ticks = 0
    for seq in range(11, 21):
        step(seq, (0.06, *FREE[1:]))
    assert len(base._gate.obstacles())
    outcome = step(0, FREE)
    assert outcome.given == AT_REST and "seen anew" in outcome.reason
    assert not len(base._gate.obstacles())
    for seq in range(1, 10):
        outcome = step(seq, FREE)
    assert outcome.given[0] > 0.09


@pytest.fixture
def proxy(simulation):
    made = CorruptingProxy(simulation.server.port)
    yield made
    made.close()


def test_a_server_that_answers_from_a_cache_stops_the_robot_until_it_lives(proxy, simulation):
    """Every answer is the last one, as a robot that stands would give it."""

    def drive_until(condition, what):
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            now = time.monotonic()
            outcome = base.step(now, PilotVelocity(0.0, 0.0, 0.2, now), None, Driving())
            if condition(outcome):
                return outcome
            time.sleep(PERIOD)
        raise AssertionError(f"{what}: {outcome}")

    with RobotinoBase(f"127.0.0.1:{proxy.port}", laser=False) as base:
        drive_until(lambda outcome: outcome.given[2] > 0.15, "it turns")
        old = json.dumps([0, 0, 0, 0, 0, 0, 7]).encode()
        proxy.spoil[ODOMETRY] = lambda _: old
        drive_until(lambda outcome: "repeats old values" in outcome.reason, "it is told")
        outcome = drive_until(lambda outcome: outcome.given == AT_REST, "it is stopped")
        assert outcome.state == "fault"
        drive_until(lambda _: abs(simulation.robot.snapshot().odometry.omega) < 0.01, "it stands")
        proxy.spoil.clear()
        drive_until(lambda outcome: outcome.state == "clear" and outcome.given[2] > 0.15, "it turns again")
        base.end()
