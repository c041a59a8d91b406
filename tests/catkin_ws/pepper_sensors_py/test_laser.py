from __future__ import annotations

import math

import numpy as np
import pytest
from naoqi_driver.replies import UnexpectedReply
from pepper_sensors.laser import KEYS, LINES, MAX_RANGE, merge, read_points, to_base, to_scan

MISS = 5.6


def fan(distances: list[float]) -> np.ndarray:
    """Points of one line, leftmost first, 60 degrees in equal parts."""
    count = len(distances)
    angles = [math.radians(30 - 60 / count * (i + 0.5)) for i in range(count)]
    return np.array([(d * math.cos(a), d * math.sin(a)) for d, a in zip(distances, angles, strict=True)])


def empty() -> dict[str, np.ndarray]:
    return {name: fan([MISS] * line.segments) for name, line in LINES.items()}


def test_every_key_of_the_six_lines_is_asked_for():
    assert len(KEYS) == 2 * (3 * 15 + 3 + 1 + 1)
    assert KEYS[0] == "Device/SubDeviceList/Platform/LaserSensor/Front/Shovel/Seg01/X/Sensor/Value"
    assert "Device/SubDeviceList/Platform/LaserSensor/Front/Vertical/Left/Seg01/Y/Sensor/Value" in KEYS
    assert "Device/SubDeviceList/Platform/LaserSensor/Right/Horizontal/Seg15/Y/Sensor/Value" in KEYS


def test_values_are_sorted_to_their_lines():
    points = read_points([float(i) for i in range(len(KEYS))])
    assert points["shovel"].tolist() == [[0, 1], [2, 3], [4, 5]]
    assert points["ground_right"].tolist() == [[8, 9]]
    assert points["srd_right"][-1].tolist() == [98, 99]


def test_missing_keys_become_nan_and_wrong_counts_are_refused():
    assert np.isnan(read_points([None] * len(KEYS))["srd_front"]).all()
    with pytest.raises(UnexpectedReply, match="list of 3 for 100 values"):
        read_points([0.0] * 3)


def test_scan_turns_left_to_right_into_right_to_left():
    scan = to_scan(fan([1.0 + 0.1 * i for i in range(15)]))
    assert scan.ranges[-1] == pytest.approx(1.0)  # Seg01, leftmost, has the greatest angle
    assert scan.ranges[0] == pytest.approx(2.4)
    assert math.degrees(scan.angle_min) == pytest.approx(-28)
    assert math.degrees(scan.angle_max) == pytest.approx(28)
    assert math.degrees(scan.increment) == pytest.approx(4)


def test_scan_angles_are_those_of_the_points():
    shifted = fan([2.0] * 15) @ np.array(((math.cos(0.035), math.sin(0.035)), (-math.sin(0.035), math.cos(0.035))))
    scan = to_scan(shifted)
    assert scan.angle_min == pytest.approx(math.radians(-28) + 0.035)


def test_nothing_hit_is_infinite_and_nothing_measured_is_nan():
    points = fan([MISS] * 15)
    points[3] = (0.0, 0.0)
    points[4] = (math.nan, math.nan)
    points[5] = (0.05, 0.0)
    ranges = to_scan(points).ranges[::-1]
    assert math.isinf(ranges[0])
    assert math.isnan(ranges[3])
    assert math.isnan(ranges[4])
    assert ranges[5] == -math.inf


@pytest.mark.parametrize("count", [1, 3])
def test_short_lines_make_scans_too(count):
    scan = to_scan(fan([1.2] * count))
    assert scan.ranges == pytest.approx([1.2] * count)
    assert scan.angle_min == pytest.approx(-math.radians(30 - 30 / count))
    assert np.isnan(to_scan(np.zeros((count, 2))).ranges).all()


def test_side_lines_look_where_the_robot_has_them():
    ahead = to_base("srd_left", np.array([[1.0, 0.0]]))[0]
    # 100.7 degrees left of ahead, from (-0.018, 0.0899) (URDF of ros-naoqi/pepper_robot).
    assert ahead == pytest.approx((-0.018 + math.cos(1.75728), 0.0899 + math.sin(1.75728)))
    assert to_base("srd_right", np.array([[1.0, 0.0]]))[0] == pytest.approx((ahead[0], -ahead[1]))


def test_merged_scan_tells_free_from_blind():
    scan = merge(empty())
    angles = np.degrees(scan.angle_min + scan.increment * np.arange(len(scan.ranges)))
    ahead = np.abs(angles) < 26
    left = (angles > 75) & (angles < 126)
    blind = (np.abs(angles) > 34) & (np.abs(angles) < 68)
    assert np.isinf(scan.ranges[ahead]).all()
    assert np.isinf(scan.ranges[left]).all()
    assert np.isnan(scan.ranges[blind]).all()


@pytest.mark.parametrize(("line", "direction"), [("srd_front", 0.0), ("srd_left", 100.7), ("srd_right", -100.7)])
def test_merged_scan_puts_a_point_where_it_is(line, direction):
    points = empty()
    points[line][7] = (1.0, 0.0)
    scan = merge(points)
    hits = np.flatnonzero(np.isfinite(scan.ranges))
    assert len(hits) == 1
    at = to_base(line, np.array([[1.0, 0.0]]))[0]
    assert scan.ranges[hits[0]] == pytest.approx(math.hypot(*at))
    assert math.degrees(scan.angle_min + scan.increment * hits[0]) == pytest.approx(direction, abs=4)


def test_the_nearer_of_two_points_in_one_direction_counts():
    points = empty()
    points["srd_front"][:] = fan([MAX_RANGE - 0.5] * 15)
    points["srd_front"][6] = points["srd_front"][7] * 0.5
    assert np.nanmin(merge(points).ranges) == pytest.approx(0.0562 + (MAX_RANGE - 0.5) / 2)
