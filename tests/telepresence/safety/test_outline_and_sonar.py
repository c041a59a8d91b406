"""Outlines, sonar echoes, and the swing of the careful scan."""

import math

import numpy as np
import pytest

from telepresence.safety import PEPPER, ROBOTINO, Command, Odometry, Outline, VelocityGate
from telepresence.safety.careful_scan import BodySwing
from telepresence.safety.scan import scan_of_ranges
from telepresence.safety.sonar import Echoes

SONAR = PEPPER.source("front sonar")


def test_a_disc_measures_distances_from_its_rim():
    distance, normals, levers = Outline.disc(0.2).measure(np.array([[0.5, 0.0], [0.0, -0.1]]))
    assert distance == pytest.approx([0.3, -0.1])
    assert normals == pytest.approx(np.array([[1.0, 0.0], [0.0, -1.0]]))
    assert levers == pytest.approx([0.0, 0.0])


def test_a_polygon_knows_which_way_turning_brings_it_nearer():
    box = Outline(((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)), 0.05)
    distance, _, levers = box.measure(np.array([[0.10, 0.30], [-0.10, 0.30]]))
    assert distance == pytest.approx([0.15, 0.15])
    assert levers == pytest.approx([0.1, -0.1])
    assert box.reach(np.array([0.0, 0.25 * math.pi])) == pytest.approx([0.15, 0.1 * math.sqrt(2.0) + 0.05], abs=1e-5)


@pytest.mark.parametrize(("vertices", "radius"), [((), 0.1), (((0.0, 0.0),), 0.0), (((0, 0), (0, 1), (1, 0)), 0.1)])
def test_an_outline_that_makes_no_sense_is_refused(vertices, radius):
    with pytest.raises(ValueError):
        Outline(vertices, radius)


def test_an_echo_counts_only_if_nothing_known_explains_it():
    echoes, scan = Echoes(), scan_of_ranges(SONAR, np.array([1.0]))
    echoes.observe(SONAR, scan, np.empty((0, 2)))
    (echo,) = echoes
    assert echo.place == pytest.approx(SONAR.origins[0] + [1.0, 0.0])
    post = SONAR.origins[0] + 1.02 * np.array([math.cos(0.4), math.sin(0.4)])
    echoes.observe(SONAR, scan, np.array([post]))
    assert not list(echoes)
    echoes.observe(SONAR, scan, np.array([SONAR.origins[0] + [0.5, 0.0]]))
    assert len(list(echoes)) == 1
    echoes.observe(SONAR, scan_of_ranges(SONAR, np.array([SONAR.max_range])), np.empty((0, 2)))
    assert not list(echoes)


def test_the_swing_covers_the_gap_between_two_beams_and_comes_home():
    swing, theta, rate, widest = BodySwing(ROBOTINO.swing), 0.0, 0.0, 0.0
    for _ in range(200):
        wanted = swing.rate(theta, 0.0, True, 0.05)
        rate += max(-0.15, min(0.15, wanted - rate))
        theta += 0.05 * rate
        widest = max(widest, abs(theta))
    assert math.radians(20.0) < widest < math.radians(32.0)
    for _ in range(100):
        theta += 0.05 * swing.rate(theta, 0.0, False, 0.05)
    assert abs(theta) < 0.05


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
