"""The view from above, looked at as pixels."""

import math
import time

import numpy as np
import pytest

from gui import theme
from gui.ros.readings import Beams, BodyState, Bumpers, Cone, Points, Safety
from gui.widgets.sensor_view import RING_WIDTH, SensorView
from telepresence.safety.outline import Outline
from telepresence.safety.robot_profile import PEPPER

SIZE, REACH = 402, 2.0
SCALE = (200.0 - RING_WIDTH) / REACH


@pytest.fixture
def view(qt):
    view = SensorView()
    view.set_robot(Outline.disc(0.25), 0.35, REACH)
    view.resize(SIZE, SIZE)
    return view


def pixel(view, x, y):
    """Colour at a place of the base frame [m]."""
    image = view.grab().toImage()
    return image.pixelColor(round(SIZE / 2 - y * SCALE), round(SIZE / 2 - x * SCALE))


def near(colour, name):
    wanted = theme.colour(name)
    return all(abs(a - b) < 40 for a, b in zip(colour.getRgb()[:3], wanted.getRgb()[:3], strict=True))


def safety(allowed, age=0.0, **more):
    values = {"gap": math.inf, "sector": None, "given": (0.0, 0.0, 0.0)} | more
    return Safety(
        "limited", "", np.asarray(allowed, float), values["gap"], values["sector"], 0.0, values["given"], False,
        time.monotonic() - age,
    )  # fmt: skip


def test_what_is_ahead_is_up_and_what_is_left_is_left(view):
    view.show_reading(Points("laser", np.array([(1.5, 0.0), (0.0, 1.0)]), time.monotonic()))
    assert near(pixel(view, 1.5, 0.0), "laser") and near(pixel(view, 0.0, 1.0), "laser")
    assert not near(pixel(view, 0.0, -1.0), "laser")


def test_old_readings_are_not_shown(view):
    view.show_reading(Points("laser", np.array([(1.5, 0.0)]), time.monotonic() - 1.5))
    assert not near(pixel(view, 1.5, 0.0), "laser")


def test_a_beam_ends_at_what_it_sees(view):
    start, bearing = np.array([(0.25, 0.0)]), np.array([0.0])
    view.show_reading(Beams("infrared", start, bearing, np.array([0.5]), 0.9, time.monotonic()))
    assert near(pixel(view, 0.75, 0.0), "infrared") and not near(pixel(view, 1.0, 0.0), "infrared")


@pytest.mark.parametrize("distance", [math.nan, math.inf, 1.0])
def test_a_sonar_that_sees_nothing_or_is_silent_is_no_obstacle(view, distance):
    view.show_reading(Cone("front", 0.0, 0.0, 0.0, 1.0, distance, 1.8, time.monotonic()))
    arc = any(near(pixel(view, 1.0 + step / SCALE, 0.1), "sonar") for step in range(-4, 5))
    assert arc == (distance == 1.0)


def test_the_ring_tells_how_fast_each_direction_may_be(view):
    allowed = np.full(72, 0.35)
    allowed[0], allowed[18] = 0.0, 0.15
    view.show_reading(safety(allowed))
    middle = (200.0 - RING_WIDTH / 2) / SCALE
    assert near(pixel(view, middle, 0.0), "blocked")
    amber = pixel(view, 0.0, middle)
    assert amber.red() > amber.green() + 20 > amber.blue() + 40
    green = pixel(view, -middle, 0.0)
    assert green.green() > green.red() + 40 and green.green() > green.blue()


def test_without_the_safety_layer_the_ring_claims_nothing(view):
    view.show_reading(safety(np.zeros(72), age=2.0))
    assert not near(pixel(view, (200.0 - RING_WIDTH / 2) / SCALE, 0.0), "blocked")


@pytest.mark.parametrize(("name", "side"), [("left", 1), ("right", -1)])
def test_a_pressed_bumper_is_marked_on_its_side(view, name, side):
    view.show_reading(Bumpers(frozenset({name}), time.monotonic()))
    at = (0.25 + 4.0 / SCALE) * math.sqrt(0.5)
    assert near(pixel(view, at, side * at), "blocked") and not near(pixel(view, at, -side * at), "blocked")


def test_the_trail_is_where_the_robot_was(view):
    for x in np.arange(0.0, 1.51, 0.1):
        view.show_reading(BodyState(x, 0.0, 0, 0, 0, math.pi / 2, 0, 0, 0, "odom", time.monotonic()))
    # It looks left now, so where it came from is to its left hand's back: along +y of its own frame.
    trail, beside = pixel(view, 0.0, 1.0), pixel(view, 0.0, -1.0)
    assert trail.blue() > beside.blue() + 30
    assert view.trail[0] == (0.0, 0.0) and len(view.trail) == 16


def test_a_jump_of_the_odometry_begins_a_new_trail(view):
    for x in (0.0, 0.1, 5.0):
        view.show_reading(BodyState(x, 0.0, 0, 0, 0, 0, 0, 0, 0, "odom", time.monotonic()))
    assert view.trail == [(5.0, 0.0)]


def test_another_robot_begins_afresh(view):
    view.show_reading(Points("laser", np.array([(1.5, 0.0)]), time.monotonic()))
    view.set_robot(PEPPER.outline, 0.35, REACH)
    assert not near(pixel(view, 1.5, 0.0), "laser") and view.trail == []
    assert near(pixel(view, 0.13, 0.1), "body") and not near(pixel(view, -0.2, 0.15), "body")
