"""Bezier curves become knots that rise in time and pass through the points."""

import numpy as np
import pytest

from pepper_sim.naoqi.motion.bezier import bezier_knots
from pepper_sim.naoqi.service import ServiceError


def test_knots_rise_and_pass_through_the_points():
    knots = bezier_knots(0.0, [1.0, 2.0], [[0.5, [3, -0.3, 0.0], [3, 0.3, 0.0]], [-0.5, [3, -0.3, 0.0]]], "points")
    times = np.array([t for t, _ in knots])
    assert (np.diff(times) > 0).all()
    assert dict(knots)[1.0] == pytest.approx(0.5) and knots[-1] == (2.0, -0.5)


def test_a_flat_handle_before_a_point_eases_into_it():
    knots = bezier_knots(0.0, [1.0], [[1.0, [3, -0.33, 0.0], [3, 0.0, 0.0]]], "points")
    late = [angle for time, angle in knots if time > 0.85]
    assert min(late) > 0.93  # a straight line would be at 0.85


def test_points_without_handles_are_straight_lines():
    knots = bezier_knots(0.0, [1.0], [1.0], "points")
    assert all(angle == pytest.approx(time, abs=0.02) for time, angle in knots)


def test_handles_never_turn_time_back():
    knots = bezier_knots(0.0, [0.5], [[1.0, [3, -9.0, 0.0], [3, 9.0, 0.0]]], "points")
    assert all(0 <= angle <= 1.001 for _, angle in knots)


@pytest.mark.parametrize("points", ["x", [], [[1.0, [3, 0.1]]], [[float("nan")]], [[]], [[1, 2, 3, 4]]])
def test_malformed_points_are_refused(points):
    with pytest.raises(ServiceError, match="points"):
        bezier_knots(0.0, [1.0], points, "points")
