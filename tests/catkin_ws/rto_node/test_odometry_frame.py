import math

import pytest
from rto_node.client import Odometry
from rto_node.odometry_frame import OdometryFrame


def reading(x, y, phi, seq):
    return Odometry(x, y, phi, 0.0, 0.0, 0.0, seq)


@pytest.fixture
def frame():
    return OdometryFrame()


def test_is_the_robots_own_at_first(frame):
    assert frame.update(reading(1.0, 2.0, 0.5, 7)) == pytest.approx((1.0, 2.0, 0.5))


def test_reset_says_where_the_robot_is_now(frame):
    frame.update(reading(1.0, 2.0, math.pi / 2, 1))
    frame.reset(0.0, 0.0, 0.0)
    assert frame.update(reading(1.0, 2.0, math.pi / 2, 2)) == pytest.approx((0.0, 0.0, 0.0))
    # One metre ahead of a robot that looks along its own y is our x.
    assert frame.update(reading(1.0, 3.0, math.pi / 2, 3)) == pytest.approx((1.0, 0.0, 0.0))


def test_reset_to_any_pose_and_again(frame):
    frame.update(reading(0.3, -0.4, 1.0, 1))
    frame.reset(5.0, 6.0, -2.0)
    frame.reset(1.0, 1.0, math.pi)
    x, y, phi = frame.update(reading(0.3 + math.cos(1.0), -0.4 + math.sin(1.0), 1.0, 2))
    assert (x, y) == pytest.approx((0.0, 1.0)) and abs(phi) == pytest.approx(math.pi)


def test_goes_on_when_the_robot_starts_again(frame):
    before = frame.update(reading(1.0, 2.0, 0.5, 1000))
    assert frame.update(reading(0.0, 0.0, 0.0, 3)) == pytest.approx(before)
    x, y, _ = frame.update(reading(1.0, 0.0, 0.0, 4))
    assert (x, y) == pytest.approx((1.0 + math.cos(0.5), 2.0 + math.sin(0.5)))
    assert frame.restarts == 1
