"""A browser's hand on the floor. Expected numbers come from the geometry; our clock is an argument."""

import math
import time

import numpy as np
import pytest

from telepresence.page.commands import BadMessage, FloorMessage, parse_floor
from telepresence.page.floor import BrowserFloor
from telepresence.teleop.floor_goal import ARRIVED, NO_FLOOR
from telepresence.teleop.robot_readings import BodyState, CameraView, Lens, Safety

LENS = Lens(fx=525.0, fy=525.0, cx=320.0, cy=240.0, width=640, height=480)
AHEAD = (0.5, 0.5 + 525.0 / 2 / 480)
"""Shows the floor 2 m ahead of a level camera 1 m high."""
NOW = 100.0


def looking(yaw):
    """A level camera 1 m over the robot's middle, turned to the left [rad]."""
    ahead, left = (math.cos(yaw), math.sin(yaw), 0.0), (-math.sin(yaw), math.cos(yaw), 0.0)
    axes = np.array(([-part for part in left], (0.0, 0.0, -1.0), ahead)).T
    return CameraView(LENS, axes, np.array((0.0, 0.0, 1.0)))


class Floor:
    farthest, radius, top_speed, top_turn = 3.0, 0.3, 0.35, 1.0

    def __init__(self):
        self.stamp = time.time()
        self.views = {self.stamp: looking(0.0)}
        self.safety = Safety("clear", "", np.full(72, 0.35), 1.0, None, 0.0, (0, 0, 0), False, time.monotonic())
        self.go(0.0, 0.0)

    def go(self, x, y, yaw=0.0, at=NOW):
        self.body = BodyState(x, y, 0.0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0, "odom", at)

    def newest(self):
        return self.stamp

    def view(self, stamp):
        return self.views[stamp]


class Hand:
    def __init__(self):
        self.floor = Floor()
        self.hand = BrowserFloor(self.floor)

    def hold(self, at=AHEAD, press=1, stamp=None, speed=0.2, hold="", forbidden="", now=NOW):
        return self.hand.step(FloorMessage(1, 0.0, at, press, stamp, speed, hold), now, forbidden)


@pytest.fixture
def hand():
    return Hand()


def test_a_held_place_is_driven_to_until_the_robot_is_there(hand):
    assert hand.hold().velocity == pytest.approx((0.2, 0.0, 0.0))
    hand.floor.go(2.0 - ARRIVED + 0.01, 0.0)
    step = hand.hold()
    assert step.velocity == (0.0, 0.0, 0.0) and step.arrived
    assert hand.hold().velocity is None


def test_no_page_makes_it_faster_than_its_gate_allows(hand):
    assert hand.hold(speed=2.0).velocity == pytest.approx((0.35, 0.0, 0.0))


def test_the_place_is_where_the_camera_looked_when_the_picture_was_taken(hand):
    """The head has turned since: the newest picture shows another place there."""
    before = hand.floor.stamp - 0.3
    hand.floor.views[before] = looking(math.radians(60))
    _, _, turn = hand.hold(stamp=before).velocity
    assert turn > 0.4
    hand.floor.go(0.0, 0.0, yaw=math.radians(60))
    assert hand.hold(stamp=before).velocity == pytest.approx((0.2, 0.0, 0.0))


def test_another_place_is_driven_to_when_the_pointer_moves(hand):
    hand.hold()
    assert hand.hold(at=(AHEAD[0] - 105 / 640, AHEAD[1])).velocity[2] > 0.2


def test_what_forbids_driving_ends_it_until_another_press(hand):
    hand.hold()
    step = hand.hold(forbidden="ben has pressed the red stop.")
    assert step.velocity == (0.0, 0.0, 0.0) and "red stop" in step.refused
    assert hand.hold(forbidden="ben has pressed the red stop.").refused == ""
    assert hand.hold().velocity is None and hand.hand.way() is None
    assert hand.hold(press=2).velocity == pytest.approx((0.2, 0.0, 0.0))


def test_what_passes_by_itself_is_waited_for(hand):
    hand.hold()
    assert hand.hold(hold="The next picture takes too long.").velocity == (0.0, 0.0, 0.0)
    step = hand.hold()
    assert step.resumed and step.velocity == pytest.approx((0.2, 0.0, 0.0))


def test_lost_odometry_stops_it(hand):
    hand.hold()
    step = hand.hold(now=NOW + 0.6)
    assert step.velocity == (0.0, 0.0, 0.0) and "odometry" in step.refused


def test_the_sky_and_an_old_picture_are_not_driven_to(hand):
    assert hand.hold(at=(0.5, 0.1)).refused == NO_FLOOR
    step = hand.hold(press=2, stamp=hand.floor.stamp - 1.5)
    assert step.velocity is None and "too old" in step.refused
    hand.floor.views[hand.floor.stamp] = "The camera publishes no calibration."
    assert "no calibration" in hand.hold(press=3).refused


def test_the_page_is_told_the_way_as_shares_of_the_picture(hand):
    assert hand.hand.way() is None
    hand.hold()
    way = hand.hand.way()
    assert way["tone"] == "free" and np.mean(way["ring"], axis=0) == pytest.approx(AHEAD, abs=0.02)
    left, right = min(u for u, _ in way["edge"]), max(u for u, _ in way["edge"])
    assert left + right == pytest.approx(1.0, abs=0.01) and left < 0.4
    hand.hand.let_go()
    assert hand.hand.way() is None


GOOD = '{"n": 1, "t": 0.5, "at": [0.5, 0.9], "press": 1, "stamp": null, "speed": 0.2, "hold": ""}'


def test_a_message_is_read():
    message = parse_floor(GOOD)
    assert (message.at, message.press, message.stamp, message.speed) == ((0.5, 0.9), 1, None, 0.2)
    assert parse_floor(GOOD.replace("null", "1.7e9")).stamp == 1.7e9


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[0.5, 0.9]", "[0.5]"), ("[0.5, 0.9]", "[0.5, 1.1]"), ("[0.5, 0.9]", '["0.5", 0.9]'), ("[0.5, 0.9]", "null"),
        ('"press": 1', '"press": 0'), ("null", '"now"'), ("0.2", "-0.1"), ("0.2", "9"), ("0.2", "NaN"), ('"n": 1,', ""),
    ],
)  # fmt: skip
def test_what_no_page_sends_is_refused(before, after):
    assert before in GOOD
    with pytest.raises(BadMessage):
        parse_floor(GOOD.replace(before, after))
