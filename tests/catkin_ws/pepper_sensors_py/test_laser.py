from __future__ import annotations

import math

import numpy as np
import pytest
from naoqi_driver.laser_points import LINES, hits, keys, to_base
from naoqi_driver.range_sensors import KEYS as GATE_KEYS
from naoqi_driver.range_sensors import LASERS, Reader
from naoqi_driver.replies import UnexpectedReply
from naoqi_driver.robot_facts import MAX_RANGE
from pepper_sensors.laser import KEYS, count_missing, merge, read_points, to_scan

from telepresence.safety import PEPPER
from telepresence.safety.scan import scan_of_points

MISS = 5.6


def fan(distances: list[float]) -> np.ndarray:
    """Points of one line, leftmost first, 60 degrees in equal parts."""
    count = len(distances)
    angles = [math.radians(30 - 60 / count * (i + 0.5)) for i in range(count)]
    return np.array([(d * math.cos(a), d * math.sin(a)) for d, a in zip(distances, angles, strict=True)])


def empty() -> dict[str, np.ndarray]:
    return {name: fan([MISS] * line.segments) for name, line in LINES.items()}


def test_values_are_sorted_to_their_lines():
    assert len(KEYS) == 2 * (3 * 15 + 3 + 1 + 1)
    points = read_points([1.0 + 0.01 * (i // 2) if i % 2 == 0 else 0.001 * i for i in range(len(KEYS))])
    assert points["shovel"] == pytest.approx(np.array([[1.0, 0.001], [1.01, 0.003], [1.02, 0.005]]))
    assert points["ground_right"] == pytest.approx(np.array([[1.04, 0.009]]))
    assert points["srd_right"][-1] == pytest.approx([1.49, 0.099])


def test_missing_keys_become_nan_and_wrong_counts_are_refused():
    assert np.isnan(to_scan(read_points([None] * len(KEYS))["srd_front"]).ranges).all()
    with pytest.raises(UnexpectedReply, match="list of 3 for 100 values"):
        read_points([0.0] * 3)


def test_values_that_are_no_numbers_are_counted():
    assert count_missing([1.0, None, math.nan, "1", 2, -1.0]) == 3


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
    at = to_base(np.array([[1.0, 0.0]]), LINES[line].frame)[0]
    assert scan.ranges[hits[0]] == pytest.approx(math.hypot(*at))
    assert math.degrees(scan.angle_min + scan.increment * hits[0]) == pytest.approx(direction, abs=4)


def test_the_nearer_of_two_points_in_one_direction_counts():
    points = empty()
    points["srd_front"][:] = fan([MAX_RANGE - 0.5] * 15)
    points["srd_front"][6] = points["srd_front"][7] * 0.5
    assert np.nanmin(merge(points).ranges) == pytest.approx(0.0562 + (MAX_RANGE - 0.5) / 2)


SEGMENT_VALUES = {
    "near": (0.4, 0.0),
    "far": (2.9, 0.1),
    "too near": (0.05, 0.0),
    "just below the range's end": (2.97, 0.0),
    "at the range's end": (3.0, 0.0),
    "beyond": (5.6, 0.0),
    "no key": (None, None),
    "half a key": (1.0, None),
    "zeros": (0.0, 0.0),
    "minus one": (-1.0, -1.0),
    "beside the fan": (1.0, 1.0),
}


@pytest.mark.parametrize("filled", SEGMENT_VALUES.values(), ids=SEGMENT_VALUES)
def test_topics_show_what_the_gate_sees(filled):
    memory: dict = dict.fromkeys(GATE_KEYS, 0.0)
    for line in LINES.values():
        points = [
            filled if i % 3 == 0 else at for i, at in enumerate(fan([1.0 + 0.1 * i for i in range(line.segments)]))
        ]
        memory.update(zip(keys(line), [value for point in points for value in point], strict=True))
    reading = Reader().read([memory[key] for key in GATE_KEYS], (0.0, 0.0, 0.0), 0.0)
    shown = read_points([memory[key] for key in KEYS])
    distances = []
    for name, line in LASERS.items():
        (topic,) = (key for key, other in LINES.items() if other is line)
        gate = scan_of_points(PEPPER.source(name), reading.points[name])
        scan = to_scan(shown[topic]).ranges[::-1]
        assert scan[np.isfinite(scan)] == pytest.approx(gate.ranges[gate.hit])
        assert (scan[gate.known] > 0.0).all(), "what the gate takes for measured is, or is free"
        assert not (scan[~gate.known] > 0.0).any(), "and nothing else is"
        assert to_base(shown[topic][hits(shown[topic])], line.frame) == pytest.approx(gate.hits)
        distances += np.hypot(*gate.hits.T).tolist()
    around = merge(shown).ranges
    around = around[np.isfinite(around)]
    assert np.isclose(around[:, None], distances).any(axis=1).all(), "nothing is shown that the gate does not see"
    assert around.min() == pytest.approx(min(distances))
