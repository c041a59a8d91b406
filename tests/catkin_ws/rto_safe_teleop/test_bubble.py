"""The guide's bubble: what it does, and the ways in which it fails. Those that need time, f11 and f12, are in the tests
of the gate: tests/catkin_ws/rto_safe_teleop/test_gates.py."""

import math

import pytest
from rto_node.robot_facts import GUIDE_ANGLE, GUIDE_RADIUS
from rto_safe_teleop.bubble import LOOK_AHEAD, Bubble, ClampLimits, clamp, points_of_ranges

NOTHING = 0.41
"""What a beam reads when nothing is there [m]."""
FAR = (5.0, 5.0)
AS_GIVEN = ClampLimits(max_linear=1.0, min_linear=0.0, max_angular=3.0, min_angular=0.0)
REACTION, BRAKING = 0.45, 0.5
"""Reaction of the guide's stack, with scans every 0.2 s [s]; braking of Robotino [m/s²]."""


def bubble(radius, *points):
    made = Bubble(radius, AS_GIVEN)
    made.update_points(points)
    return made


def passes(made, vx, vy=0.0):
    return made.command(vx, vy, 0.0)[:2] == (vx, vy)


def reading(beam, x, y, radius):
    """What a beam without width reads of a round pole; it starts at the rim of the guide's robot."""
    angle = GUIDE_ANGLE * beam
    along, across = x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle)
    if along < 0.0 or abs(across) >= radius:
        return NOTHING
    return min(NOTHING, along - math.sqrt(radius**2 - across**2) - GUIDE_RADIUS)


# --- what it does -----------------------------------------------------------------------------------------------------


def test_points_lie_where_the_guide_puts_them():
    points = points_of_ranges([0.1] * 9)
    assert points[0] == pytest.approx((0.3, 0.0))
    assert points[2] == pytest.approx((0.3 * math.cos(1.396), 0.3 * math.sin(1.396)))


@pytest.mark.parametrize(
    ("value", "mapped"),
    [(0.5, 0.2), (-0.5, -0.2), (0.1, 0.1), (0.01, 0.05), (-0.01, -0.05), (0.0, 0.0)],
)
def test_large_values_are_cut_and_small_ones_raised(value, mapped):
    assert clamp(value, 0.2, 0.05) == mapped


def test_without_a_breach_commands_pass():
    assert passes(bubble(0.3, (0.31, 0.0)), 0.2)


def test_a_breach_that_the_command_leaves_is_no_reason_to_stop():
    assert passes(bubble(0.3, (0.28, 0.0)), -0.2)


def test_a_breach_that_stays_one_leaves_only_the_turning():
    assert bubble(0.3, (0.28, 0.0)).command(0.2, 0.0, 0.4) == (0.0, 0.0, 0.4)


# --- how it fails -----------------------------------------------------------------------------------------------------


def test_f1_a_leg_between_two_beams_touches_the_body_unseen():
    diameter, bearing = 0.20, 0.5 * GUIDE_ANGLE
    centre = GUIDE_RADIUS + 0.5 * diameter
    x, y = centre * math.cos(bearing), centre * math.sin(bearing)
    ranges = [reading(beam, x, y, 0.5 * diameter) for beam in range(9)]
    assert ranges == [NOTHING] * 9
    made = bubble(0.4, *points_of_ranges(ranges))
    assert passes(made, 0.2 * math.cos(bearing), 0.2 * math.sin(bearing))


def test_f2_contact_looks_clear_to_a_sensor_that_folds_back():
    true_distance, told = 0.0, 0.10  # Sharp sensors, below 4 cm
    assert not passes(bubble(0.25, *points_of_ranges([true_distance, *[NOTHING] * 8])), 0.2)
    assert passes(bubble(0.25, *points_of_ranges([told, *[NOTHING] * 8])), 0.2)


def test_f3_outside_the_bubble_nobody_looks_ahead():
    radius, speed = 0.30, 0.20
    distance = radius + 0.001
    assert passes(bubble(radius, (distance, 0.0)), speed)
    stopping = speed * REACTION + speed**2 / (2.0 * BRAKING)
    assert distance - stopping < GUIDE_RADIUS  # it stops after the hit


def test_f4_a_slow_robot_deep_in_the_bubble_never_gets_out():
    radius, speed = 0.30, 0.05
    edge = radius - LOOK_AHEAD * speed
    assert passes(bubble(radius, (edge + 0.001, 0.0)), -speed)
    assert not passes(bubble(radius, (edge - 0.001, 0.0)), -speed)


def test_f5_one_point_vetoes_leaving_another():
    ahead, behind = (0.28, 0.0), (-0.40, 0.1)
    assert passes(bubble(0.3, ahead), -0.2)
    assert not passes(bubble(0.3, ahead, behind), -0.2)


def test_f6_a_fast_robot_is_let_through_an_obstacle():
    made = bubble(0.30, (0.25, 0.0))
    assert not passes(made, 0.68)
    assert passes(made, 0.70)


def test_f7_sliding_along_is_refused():
    made = bubble(0.30, (0.0, 0.28))
    assert not passes(made, 0.13)
    assert passes(made, 0.14)


def test_f8_turning_passes_whatever_it_hits():
    assert bubble(0.4, *points_of_ranges([0.0] * 9)).command(0.0, 0.0, 1.0) == (0.0, 0.0, 1.0)


def test_f9_an_old_scan_is_good_for_ever():
    made = bubble(0.3, FAR)
    assert all(passes(made, 0.2) for _ in range(10_000))  # hours of commands, one scan


def test_f10_without_a_scan_commands_vanish():
    assert Bubble(0.3).command(0.2, 0.0, 0.0) is None


@pytest.mark.parametrize("point", [(math.nan, 0.0), (0.0, math.nan)])
def test_f13_a_range_that_is_no_number_is_free_space(point):
    assert passes(bubble(0.4, point), 0.2)


def test_f13_a_command_that_is_no_number_is_sent():
    sent = bubble(0.4, FAR).command(math.nan, 0.0, 0.0)
    assert math.isnan(sent[0])


def test_f14_limits_in_circulation_make_everything_a_crawl():
    shipped = ClampLimits(max_linear=0.02, min_linear=0.05)
    made = Bubble(0.3, shipped)
    made.update_points([FAR])
    assert made.command(0.2, 0.0, 0.0)[0] == 0.02
