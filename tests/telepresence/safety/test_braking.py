"""The gate's braking law: room, speed, sliding, symmetry."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telepresence.safety import PEPPER, ROBOTINO
from telepresence.safety.braking import project, stopping_distance, stopping_speed, turning_rate
from telepresence.safety.obstacles import Obstacles
from telepresence.safety.plane import from_base

places = st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8)).filter(lambda place: math.hypot(*place) > 0.05)
points = st.lists(places, min_size=1, max_size=8)
speeds = st.floats(-0.14, 0.14)


def velocity_bounds(places, profile=ROBOTINO):
    places = np.array(places, float)
    found = Obstacles.around(profile, places, np.zeros(len(places)), np.zeros_like(places))
    return found.velocity_bounds(profile.limits, profile.outline, found.room, (0.0,))


@given(st.floats(0.0, 3.0), st.floats(0.05, 0.6), st.floats(0.1, 1.0))
def test_stopping_speed_and_distance_are_inverse(distance, reaction, braking):
    speed = float(stopping_speed(distance, reaction, braking))
    assert stopping_distance(speed, reaction, braking) == pytest.approx(distance, abs=1e-9)


@given(points, speeds, speeds, st.floats(-math.pi, math.pi))
@settings(max_examples=100)
def test_a_disc_knows_no_direction(places, vx, vy, angle):
    before = velocity_bounds(places).nearest_allowed(vx, vy)
    turned = from_base(np.array(places), 0.0, 0.0, angle)
    (tx, ty), (wx, wy) = from_base(np.array([[vx, vy], before]), 0.0, 0.0, angle)
    assert math.hypot(*velocity_bounds(turned).nearest_allowed(tx, ty)) == pytest.approx(math.hypot(wx, wy), abs=1e-5)


@given(points, speeds, speeds)
@settings(max_examples=100)
def test_what_is_allowed_leaves_every_obstacle_its_room(places, vx, vy):
    for profile in (ROBOTINO, PEPPER):
        allowed = np.array(velocity_bounds(places, profile).nearest_allowed(vx, vy))
        speed = float(np.hypot(*allowed))
        outside = np.array(places)[profile.outline.measure(np.array(places))[0] > 1e-6]
        if speed < 1e-9 or not len(outside):
            continue
        limits = profile.limits
        rest = stopping_distance(speed, limits.reaction, limits.braking) * allowed / speed
        assert (profile.outline.measure(outside - rest)[0] > 0.0).all()


@given(st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)), min_size=1, max_size=8), speeds, speeds)
@settings(max_examples=100)
def test_who_need_not_look_would_find_nothing_in_the_way(places, vx, vy):
    bounds = velocity_bounds(places, PEPPER)
    careful = velocity_bounds(places, PEPPER)
    object.__setattr__(careful, "_none_within_reach", lambda _speed: False)
    assert bounds.nearest_allowed(vx, vy) == pytest.approx(careful.nearest_allowed(vx, vy), abs=1e-9)


def test_straight_at_a_wall_stops_and_along_it_goes():
    wall = [(0.2266 + 0.03, y) for y in np.linspace(-0.5, 0.5, 21)]
    assert velocity_bounds(wall).nearest_allowed(0.2, 0.0) == (0.0, 0.0)
    assert velocity_bounds(wall).nearest_allowed(0.0, 0.2) == pytest.approx((0.0, 0.2))
    assert velocity_bounds(wall).nearest_allowed(-0.2, 0.0) == pytest.approx((-0.2, 0.0))


@pytest.mark.parametrize("degrees", [30, 45, 60])
def test_slanted_into_a_wall_keeps_the_part_along_it(degrees):
    wall = [(0.2266 + 0.035, y) for y in np.linspace(-0.6, 0.6, 25)]
    vx, vy = 0.2 * math.sin(math.radians(degrees)), 0.2 * math.cos(math.radians(degrees))
    x, y = velocity_bounds(wall).nearest_allowed(vx, vy)
    assert y >= 0.9 * vy and x < 0.05


def test_away_is_free_from_the_middle_of_a_corner():
    corner = [(0.24, y) for y in np.linspace(-0.3, 0.24, 10)] + [(x, 0.24) for x in np.linspace(-0.3, 0.24, 10)]
    assert velocity_bounds(corner).nearest_allowed(-0.1, -0.1) == pytest.approx((-0.1, -0.1))


@given(st.tuples(speeds, speeds), points)
def test_projection_is_the_nearest_possible_point(wanted, normals):
    normals = np.array(normals)
    normals /= np.hypot(normals[:, 0], normals[:, 1])[:, None]
    bounds = np.linspace(0.0, 0.2, len(normals))
    found = project(np.array(wanted), normals, bounds)
    assert (normals @ found <= bounds + 1e-6).all()
    grid = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 41), np.linspace(-0.5, 0.5, 41)), axis=-1).reshape(-1, 2)
    possible = grid[(normals @ grid.T <= bounds[:, None]).all(axis=0)]
    assert np.hypot(*(found - wanted)) <= np.hypot(*(possible - wanted).T).min() + 1e-6


def test_a_disc_may_always_turn_and_a_triangle_not_into_what_is_beside():
    beside = np.array([[0.10, 0.26]])
    _, _, levers = PEPPER.outline.measure(beside)
    towards = math.copysign(1.0, levers[0])
    limits = PEPPER.limits
    assert abs(turning_rate(towards, np.zeros(1), levers, limits.reaction, limits.braking_turn)[0]) < 0.05
    assert turning_rate(-towards, np.zeros(1), levers, limits.reaction, limits.braking_turn)[0] == -towards
    _, _, levers = ROBOTINO.outline.measure(beside)
    assert turning_rate(1.0, np.zeros(1), levers, 0.2, 2.0)[0] == 1.0
