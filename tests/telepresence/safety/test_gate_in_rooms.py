"""The gate in a few rooms of the safety benchmark: notices when a change makes it worse."""

from __future__ import annotations

from functools import cache

import pytest
from safety.robots import INFRARED_ROBOT, LASER_ROBOT, MEASURED_ROBOT, PEPPER_ROBOT
from safety.suite import GATES, Cell
from safety.trials import AWAY_WITHIN, doorway, escapes, false_stops, slide, thin_legs
from safety.worlds import PERSON

pytestmark = pytest.mark.slow

SEED = 2
"""One of the tuning seeds: these rooms are not those of the published figures."""


@cache
def drive(robot, gate, speed, first):
    """A batch of 10 rooms, 20 s each."""
    return Cell(robot, gate, speed, first, 10, 20.0).run(SEED)


def passed(outcome):
    return outcome.passed.sum() / outcome.asked.sum()


def test_careful_scan_hits_nothing_that_stands():
    outcome = drive("infrared", "gate, careful", 0.20, 60)
    assert outcome.static_hits.sum() == 0
    assert passed(outcome) > 0.85


@pytest.mark.parametrize("robot", [INFRARED_ROBOT, MEASURED_ROBOT], ids=lambda robot: robot.name)
def test_careful_scan_meets_thin_legs_before_the_robot_does(robot):
    assert thin_legs(robot, 0.20, 40, SEED).max(initial=0.0) < 0.05


def test_careful_scan_meets_thin_legs_slowly_with_sensors_that_see_no_farther_than_promised():
    assert thin_legs(MEASURED_ROBOT, 0.20, 40, SEED, reach=0.30).max(initial=0.0) < 0.14


def test_without_it_the_gate_hits_far_less_than_the_bubble_and_passes_no_less():
    ours, bubble = drive("infrared", "gate", 0.20, 40), drive("infrared", "bubble, gap 0.10", 0.20, 40)
    assert bubble.static_hits.sum() >= 3
    assert bubble.static_hits.sum() >= 3 * ours.static_hits.sum()
    assert passed(ours) >= passed(bubble) - 0.02


def test_with_a_laser_nothing_that_stands_is_hit():
    outcome = drive("laser", "gate", 0.35, 0)
    assert outcome.static_hits.sum() == 0
    assert passed(outcome) > 0.8


def test_pepper_hits_only_what_its_sensors_cannot_see():
    outcome = drive("pepper", "gate", 0.35, 0)
    assert all(contact.blind for contact in outcome.contacts if contact.kind != PERSON)
    assert passed(outcome) > 0.65


@pytest.mark.parametrize("robot", [INFRARED_ROBOT, LASER_ROBOT, PEPPER_ROBOT], ids=lambda robot: robot.name)
def test_every_way_out_of_a_breach_is_open(robot):
    found = escapes(robot, 12, SEED)
    assert found.obeyed == found.asked == 12, f"not within {AWAY_WITHIN} s"


def test_sliding_along_a_wall_keeps_the_speed():
    assert slide(LASER_ROBOT, 0.35, 6, SEED).mean() > 0.88


def test_a_door_15_cm_wider_than_the_body_is_passable():
    assert doorway(INFRARED_ROBOT, 0.20, 4, SEED) == (4, 0)


def test_empty_space_stops_nobody():
    assert false_stops(INFRARED_ROBOT, 0.20, 3, 10.0, SEED) <= 0.01


def test_every_gate_of_the_benchmark_drives():
    for gate in GATES:
        assert Cell("infrared", gate, 0.20, 0, 2, 2.0).run(SEED).commands.sum() == 40
