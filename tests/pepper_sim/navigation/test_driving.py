"""Driving around what is in the way, free zones and trajectories."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pepper_sim.navigation.behaviours import NotMoved
from pepper_sim.navigation.free_zone import find_free_zone
from pepper_sim.navigation.trajectory import BadTrajectory, read_trajectory

LINE = ["Holonomic", ["Line", [0.01, 0.0]], 0.0, 1.0]


def test_the_robot_drives_around_a_post(navigation_in):
    navigation = navigation_in("empty")
    navigation.stand_at(-1.5, 2.0, math.pi)
    assert navigation.finish(navigation.driver.drive_near(2.0, 0.6)) is True  # straight on there is the post
    x, y = navigation.robot.truth()[:2]
    assert math.dist((x, y), (-3.5, 1.4)) < 0.15


def test_a_goal_inside_an_obstacle_is_replaced(navigation_in):
    navigation = navigation_in("empty")
    navigation.stand_at(-1.5, 2.0, math.pi)
    assert navigation.finish(navigation.driver.drive_near(1.0, 0.0)) is False
    assert "goal" in dict(navigation.reports)
    x, y = navigation.robot.truth()[:2]
    assert 0.3 < math.dist((x, y), (-2.5, 2.0)) < 0.7


def test_a_robot_asleep_does_not_look_around(navigation_in):
    navigation = navigation_in("empty")
    navigation.robot.set_stiffness(dict.fromkeys(navigation.robot.JOINTS, 0.0))
    with pytest.raises(NotMoved):
        navigation.finish(navigation.driver.sweep())


def test_a_free_zone_is_where_the_floor_was_seen(navigation_in):
    navigation = navigation_in("empty")
    navigation.stand_at(3.2, 0.0)
    unseen = find_free_zone(navigation.surveyor.recent(), navigation.surveyor.odometry(), 0.6, 0.5)
    assert not unseen.fulfilled and unseen.radius < 0.6
    navigation.finish(navigation.driver.sweep())
    here = navigation.surveyor.odometry()
    zone = find_free_zone(navigation.surveyor.recent(), here, 0.9, 0.5)
    # 0.8 m to the wall ahead: the circle moves back.
    assert zone.fulfilled and zone.radius == 0.9
    assert zone.x - here.x == pytest.approx(-0.15, abs=0.12)
    assert not find_free_zone(navigation.surveyor.recent(), here, 2.5, 0.5).fulfilled


def test_lines_and_circles_become_waypoints():
    there, back = read_trajectory(
        ["Composed", ["Holonomic", ["Line", [1.0, 0.0]], 0.5, 5.0], ["Holonomic", ["Line", [-1.0, 0.0]], 0.0, 10.0]]
    )
    assert there.waypoints == ((1.0, 0.0, 0.5),) and there.duration == 5.0
    assert back.waypoints == ((-1.0, 0.0, 0.0),) and back.duration == 10.0
    (half,) = read_trajectory(["Holonomic", ["Circle", [0.0, 0.5], math.pi], math.pi, 8.0])
    assert half.waypoints[-1] == pytest.approx((0.0, 1.0, math.pi))
    assert np.hypot(*(np.array(half.waypoints)[:, :2] - (0.0, 0.5)).T) == pytest.approx(0.5)
    (composed,) = read_trajectory(["Holonomic", ["Composed", ["Line", [1.0, 0.0]], ["Line", [0.0, 1.0]]], 0.0, 4.0])
    assert composed.waypoints[-1] == (1.0, 1.0, 0.0)


def test_a_trajectory_has_many_pieces():
    assert len(read_trajectory(["Composed", *([LINE] * 1000)])) == 1000
    half = ["Holonomic", ["Composed", *([["Line", [0.001, 0.0]]] * 500)], 0.0, 50.0]
    assert len(read_trajectory(["Composed", half, half])) == 2
    with pytest.raises(BadTrajectory, match="1000 pieces"):
        read_trajectory(["Composed", half, half, LINE])


@pytest.mark.parametrize(
    "value",
    [
        *(1.0, "Line", [], ["Line", [1.0, 0.0]], ["Holonomic", ["Line", [1.0]], 0.0, 1.0]),
        *(["Holonomic", ["Line", [1.0, 0.0]], 0.0, 0.0], ["Holonomic", ["Line", [math.nan, 0.0]], 0.0, 1.0]),
        *(["Composed", *([LINE] * 1001)], ["Composed", *([["Composed", *([LINE] * 501)]] * 2)]),
        *(["Composed"], ["Holonomic", ["Circle", [0.0, 1.0], 1e9], 0.0, 1.0], ["Holonomic", ["Line", [1.0, 0.0]]]),
    ],
)
def test_what_is_no_trajectory_is_refused(value):
    with pytest.raises(BadTrajectory):
        read_trajectory(value)
