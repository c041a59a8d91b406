"""What the values of laser segments mean, for the gate and the topics."""

import math

import numpy as np
import pytest
from naoqi_driver.laser_points import LINES, NOTHING_AT, clean, hits, keys, to_base


def test_keys_are_those_of_almemory():
    assert keys(LINES["shovel"])[0] == "Device/SubDeviceList/Platform/LaserSensor/Front/Shovel/Seg01/X/Sensor/Value"
    assert keys(LINES["ground_left"]) == [
        f"Device/SubDeviceList/Platform/LaserSensor/Front/Vertical/Left/Seg01/{axis}/Sensor/Value" for axis in "XY"
    ]
    assert keys(LINES["srd_right"])[-1] == (
        "Device/SubDeviceList/Platform/LaserSensor/Right/Horizontal/Seg15/Y/Sensor/Value"
    )


def test_a_point_within_the_range_stays_where_it_is():
    assert clean([1.0, 0.25]).tolist() == [[1.0, 0.25]]
    assert hits(clean([1.0, 0.25])).tolist() == [True]


@pytest.mark.parametrize("distance", [2.96, 2.9999998, 3.0, 5.6])
def test_a_point_at_the_end_of_the_range_means_that_nothing_was_hit(distance):
    points = clean([distance * math.cos(0.3), distance * math.sin(0.3)])
    assert points[0] == pytest.approx([NOTHING_AT * math.cos(0.3), NOTHING_AT * math.sin(0.3)])
    assert not hits(points).any()


@pytest.mark.parametrize("filler", [(None, None), (1.0, None), (0.0, 0.0), (-1.0, -1.0), (0.0, 1.0), ("1", "0")])
def test_a_filler_says_nothing(filler):
    points = clean([1.0, 0.0, *filler])
    assert points.tolist() == [[1.0, 0.0], [0.0, 0.0]]
    assert hits(points).tolist() == [True, False]


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300, 10**400])
def test_what_nobody_can_have_measured_is_nan(value):
    points = clean([1.0, 0.0, value, 0.0])
    assert np.isnan(points[1]).any() and points[0].tolist() == [1.0, 0.0]
    assert hits(points).tolist() == [True, False]


def test_side_lines_look_where_the_robot_has_them():
    ahead = to_base(np.array([[1.0, 0.0]]), LINES["srd_left"].frame)[0]
    # 100.7 degrees left of ahead, from (-0.018, 0.0899) (URDF of ros-naoqi/pepper_robot).
    assert ahead == pytest.approx((-0.018 + math.cos(1.75728), 0.0899 + math.sin(1.75728)))
    assert to_base(np.array([[1.0, 0.0]]), LINES["srd_right"].frame)[0] == pytest.approx((ahead[0], -ahead[1]))
