"""Answers of ALMemory made into readings of the gate's sources. Times are invented."""

import math

import numpy as np
import pytest
from naoqi_driver.range_sensors import KEYS, Reader
from naoqi_driver.replies import UnexpectedReply

from telepresence.safety import PEPPER, UNKNOWN

ODOMETRY = (1.0, 2.0, 0.5)
FAR = [(3.1 * math.cos(a), 3.1 * math.sin(a)) for a in np.radians(28.0 - 4.0 * np.arange(15))]


class Robot:
    """ALMemory of a robot that sees nothing."""

    def __init__(self):
        self.reader = Reader()
        self.values = dict.fromkeys(KEYS, 0.0)
        for key in KEYS:
            if "Horizontal" in key:
                segment = int(key.partition("Seg")[2][:2]) - 1
                self.values[key] = FAR[segment]["/Y/" in key]
            elif "Sonar" in key:
                self.values[key] = 2.6

    def set(self, part, value):
        keys = [key for key in KEYS if part in key]
        assert keys
        self.values.update(dict.fromkeys(keys, value))

    def read(self, stamp):
        return self.reader.read(list(self.values.values()), ODOMETRY, stamp)


def test_points_lie_where_their_camera_sees_them():
    robot = Robot()
    robot.set("Front/Horizontal/Seg08/X", 1.0)
    robot.set("Left/Horizontal/Seg08/X", 1.0)
    reading = robot.read(5.0)
    assert reading.points["front laser"][7] == pytest.approx([1.0562, 0.0])
    assert reading.points["left laser"][7] == pytest.approx(
        [-0.018 + math.cos(1.75728), 0.0899 + math.sin(1.75728)], abs=1e-6
    )
    assert np.array(reading.odometry) == pytest.approx([*ODOMETRY, 5.0])


def test_a_point_at_the_end_of_the_range_is_no_obstacle():
    robot = Robot()
    robot.set("Front/Horizontal/Seg08/X", 2.9999998)
    point = robot.read(0.0).points["front laser"][7]
    assert point[0] - PEPPER.source("front laser").origins[0][0] == pytest.approx(3.5)


@pytest.mark.parametrize("filler", [None, -1.0, 0.0])
def test_a_segment_without_a_point_is_a_point_in_its_camera(filler):
    robot = Robot()
    robot.set("Front/Horizontal/Seg03", filler)
    points = robot.read(0.0).points["front laser"]
    assert points[2] == pytest.approx(PEPPER.source("front laser").origins[0])
    assert np.hypot(*(points[3] - PEPPER.source("front laser").origins[0])) > 3.0


def test_values_that_are_no_numbers_are_passed_on_so_that_the_gate_refuses_them():
    robot = Robot()
    robot.set("Front/Horizontal/Seg03/X", math.nan)
    robot.set("Back/Sonar", math.inf)
    reading = robot.read(0.0)
    assert not np.isfinite(reading.points["front laser"]).all()
    assert reading.ranges == {"front sonar": 2.6, "back sonar": math.inf}


@pytest.mark.parametrize("filler", [None, -1.0, 0.0])
def test_a_sonar_without_an_echo_time_says_nothing(filler):
    robot = Robot()
    robot.set("Back/Sonar", filler)
    assert robot.read(0.0).ranges["back sonar"] == UNKNOWN


def test_a_laser_that_no_longer_counts_measures_nothing_new():
    robot = Robot()
    assert set(robot.read(0.0).points) == {"front laser", "left laser", "right laser"}
    robot.set("FrameCount", 1.0)
    assert set(robot.read(0.16).points) == {"front laser", "left laser", "right laser"}
    robot.set("Left/Reg/FrameCount", 2.0)
    assert set(robot.read(0.32).points) == {"left laser"}
    assert not robot.read(10.0).points


def test_a_laser_that_has_never_counted_is_new_with_every_period():
    robot = Robot()
    robot.set("FrameCount", None)
    assert robot.read(0.0).points
    assert not robot.read(0.1).points
    assert robot.read(0.17).points
    robot.set("Front/Horizontal/Seg01/X", 1.5)
    assert set(robot.read(0.2).points) == {"front laser"}


def test_pressed_bumpers_are_told_by_their_direction():
    robot = Robot()
    robot.set("FrontLeft/Bumper", 1.0)
    robot.set("Back/Bumper", 1.0)
    assert robot.read(0.0).pressed == pytest.approx((1.054, math.pi), abs=1e-3)


def test_an_answer_of_the_wrong_length_is_an_error():
    with pytest.raises(UnexpectedReply, match="list of 3 for 98 values"):
        Reader().read([1, 2, 3], ODOMETRY, 0.0)
    for nowhere in ((), None, (0.0, 0.0, math.nan), (0.0, 0.0, "0"), (1e300, 0.0, 0.0)):
        with pytest.raises(UnexpectedReply, match="getRobotPosition"):
            Reader().read([0.0] * len(KEYS), nowhere, 0.0)
