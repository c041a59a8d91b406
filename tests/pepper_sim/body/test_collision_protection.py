"""External collision protection: what may be driven towards obstacles, and that nothing gets stuck."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pepper_sim.body.collision_protection import SecurityZone, gap_to_outline
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world

ORIGIN = (0.0, 0.0, 0.0)


def zone_with(*points: tuple[float, float]) -> SecurityZone:
    zone = SecurityZone()
    zone.update("test", np.array(points, float).reshape(-1, 2), ORIGIN)
    return zone


@pytest.mark.parametrize(
    ("point", "gap", "normal"),
    [
        ((0.275, 0.0), 0.10, (1.0, 0.0)),
        ((-0.355, 0.0), 0.10, (-1.0, 0.0)),
        ((0.09, 0.44), 0.20, (0.0, 1.0)),
        ((0.09, 0.0), -0.085, (1.0, 0.0)),
    ],
)
def test_gap_to_the_outline(point, gap, normal):
    gaps, normals = gap_to_outline(np.array([point]))
    assert gaps[0] == pytest.approx(gap)
    if gap > -0.08:
        assert normals[0] == pytest.approx(normal, abs=1e-9)


@pytest.mark.parametrize(
    ("gap", "speed"), [(0.45, 0.55), (0.30, 0.35), (0.25, 0.3), (0.17, 0.2), (0.12, 0.1), (0.10, 0.0), (0.02, 0.0)]
)
def test_the_documented_distances_limit_the_speed(gap, speed):
    zone = zone_with((0.175 + gap, 0.0))
    factor, obstacle = zone.limit(0.55, 0.0, ORIGIN)
    assert factor * 0.55 == pytest.approx(speed, abs=1e-6)
    assert (obstacle is None) == (speed == 0.55)


def test_motion_that_does_not_approach_is_free():
    zone = zone_with((0.2, 0.0))
    for velocity in ((-0.3, 0.0), (0.0, 0.3), (0.0, -0.3), (-0.2, 0.2)):
        assert zone.limit(*velocity, ORIGIN) == (1.0, None)
    assert zone.limit(0.3, 0.0, ORIGIN)[0] == 0.0


def test_obstacles_stay_where_they_were_seen():
    zone = SecurityZone()
    zone.update("laser", np.array([[0.8, 0.0]]), (1.0, 0.0, math.pi / 2))
    factor, obstacle = zone.limit(0.3, 0.0, (1.0, 0.52, math.pi / 2))
    assert factor == pytest.approx(0.0, abs=0.3)
    assert obstacle == pytest.approx((1.0, 0.8))
    assert zone.limit(0.3, 0.0, (1.0, 0.52, -math.pi / 2)) == (1.0, None)


def test_a_sensor_that_sees_nothing_more_clears_its_obstacles():
    zone = zone_with((0.2, 0.0))
    zone.update("test", np.zeros((0, 2)), ORIGIN)
    assert zone.limit(0.3, 0.0, ORIGIN) == (1.0, None)


def test_distances_can_be_set_and_the_protection_switched_off():
    zone = zone_with((0.175 + 0.2, 0.0))
    cautious = zone.limit(0.35, 0.0, ORIGIN)[0]
    zone.orthogonal = 0.1
    assert zone.limit(0.35, 0.0, ORIGIN)[0] == 1.0 > cautious
    zone.orthogonal = 0.8
    zone.update("test", np.array([[0.175 + 0.2, 0.0]]), ORIGIN)
    assert zone.limit(0.35, 0.0, ORIGIN)[0] < cautious
    zone.enabled = False
    assert zone.limit(0.35, 0.0, ORIGIN) == (1.0, None)


def drive_into_the_wall(velocity: tuple[float, float], enabled: bool = True) -> Pepper:
    pepper = Pepper(build_world("empty", [pepper_model()]), None)
    pepper.security.enabled = enabled
    pepper.set_velocity(*velocity, 0.0)
    pepper.world.step(3600)
    return pepper


@pytest.mark.parametrize(
    ("velocity", "reach"),
    [((0.35, 0.0), (4.0 - 0.175, 0)), ((-0.35, 0.0), (4.0 - 0.255, 0)), ((0.0, 0.35), (3.0 - 0.24, 1))],
)
def test_stops_before_a_wall_and_can_leave_it(velocity, reach):
    contact, axis = reach
    pepper = drive_into_the_wall(velocity)
    gap = contact - abs(pepper.truth()[axis])
    assert 0.05 < gap < 0.20
    assert pepper.snapshot().velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    failure = pepper.snapshot().move_failed
    assert (failure.count, failure.cause, failure.started) == (1, "obstacle", True)
    assert math.hypot(*failure.obstacle[:2]) > 2.9
    assert not any(pepper.snapshot().bumpers.values())

    here = pepper.truth()
    for way in ((-velocity[0], -velocity[1]), (-velocity[1], velocity[0]), (velocity[1], -velocity[0])):
        pepper.set_velocity(*way, 0.0)
        pepper.world.step(200)
        pepper.stop_move()
        pepper.world.step(200)
        moved = pepper.truth()
        assert math.hypot(moved[0] - here[0], moved[1] - here[1]) > 0.15, f"stuck when told to go {way}"
        here = moved


def test_each_time_it_is_blocked_counts_once():
    pepper = drive_into_the_wall((0.35, 0.0))
    for _ in range(20):
        pepper.set_velocity(0.35, 0.0, 0.0)
        pepper.world.step(10)
    assert pepper.snapshot().move_failed.count == 1
    pepper.set_velocity(-0.35, 0.0, 0.0)
    pepper.world.step(600)
    pepper.set_velocity(0.35, 0.0, 0.0)
    pepper.world.step(1200)
    assert pepper.snapshot().move_failed.count == 2


def test_turning_at_a_wall_stays_possible():
    pepper = drive_into_the_wall((0.35, 0.0))
    pepper.set_velocity(0.0, 0.0, 1.0)
    pepper.world.step(400)
    assert pepper.truth()[5] > 1.0


def test_a_move_into_a_wall_fails_and_says_where():
    pepper = Pepper(build_world("empty", [pepper_model()]), None)
    move = pepper.move_to([(6.0, 0.0, 0.0)])
    while not move.done():
        pepper.world.step(10)
        assert pepper.world.time < 40.0
    assert move.result() is False
    failure = pepper.snapshot().move_failed
    assert (failure.cause, failure.started) == ("obstacle", True)
    assert failure.obstacle[0] == pytest.approx(4.0, abs=0.05)
    refused = pepper.move_to([(1.0, 0.0, 0.0)])
    pepper.world.step(100)
    assert refused.result(0) is False
    assert (pepper.snapshot().move_failed.count, pepper.snapshot().move_failed.started) == (2, False)


def test_switched_off_it_drives_against_the_wall_and_odometry_goes_on():
    pepper = drive_into_the_wall((0.35, 0.0), enabled=False)
    now = pepper.snapshot()
    assert 4.0 - 0.175 - pepper.truth()[0] == pytest.approx(0.0, abs=0.01)
    assert now.odometry[0] > 5.5
    assert now.bumpers["FrontLeft"] and now.bumpers["FrontRight"] and not now.bumpers["Back"]
    assert not now.fallen
