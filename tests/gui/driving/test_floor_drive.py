"""Hold on the floor to drive there. Time passes unaided; places are exact."""

import math
import time

import numpy as np
import pytest

from gui.driving.floor_drive import FloorDrive
from gui.ros.readings import BodyState, CameraView, Lens, Safety
from telepresence.teleop.floor_goal import ARRIVED

LENS = Lens(fx=525.0, fy=525.0, cx=320.0, cy=240.0, width=640, height=480)
LEVEL = np.array(((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)))
AHEAD = (320.0, 240.0 + 525.0 / 2)
"""The pixel that shows the floor 2 m ahead of a level camera 1 m high."""


def body(x=0.0, y=0.0, yaw=0.0, age=0.0):
    return BodyState(x, y, 0.0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0, "odom", time.monotonic() - age)


def safety(state="clear", allowed=0.35):
    return Safety(state, "a wall is ahead", np.full(72, allowed), 0.5, 0, 0.0, (0, 0, 0), False, time.monotonic())


class Rig:
    def __init__(self):
        self.view = CameraView(LENS, LEVEL, np.array((0.0, 0.0, 1.0)))
        self.age = 0.0
        self.drive = FloorDrive(lambda: self.view, lambda: self.age)
        self.sent, self.refused, self.targets, self.arrivals, self.resumed = [], [], [], [], []
        self.drive.velocity.connect(lambda *v: self.sent.append(v))
        self.drive.refused.connect(self.refused.append)
        self.drive.target_changed.connect(self.targets.append)
        self.drive.arrived.connect(lambda: self.arrivals.append(1))
        self.drive.resumed.connect(lambda: self.resumed.append(1))
        self.drive.show_reading(body())
        self.drive.show_reading(safety())


@pytest.fixture
def rig(qt, monkeypatch):
    monkeypatch.setattr("telepresence.teleop.floor_goal.HOLD", 0.0)
    # Most tests show odometry once, and a busy machine may take longer than half a second over the rest.
    monkeypatch.setattr("telepresence.teleop.floor_goal.POSE_MAX_AGE", 30.0)
    rig = Rig()
    yield rig
    rig.drive.release_all()


def test_drives_towards_the_floor_while_held_and_sends_one_zero_on_release(rig, spin):
    rig.drive.press(*AHEAD)
    assert rig.drive.target == pytest.approx((2.0, 0.0))
    spin(lambda: len(rig.sent) >= 4, "commands are repeated")
    assert rig.sent[0] == pytest.approx((0.2, 0.0, 0.0))
    rig.drive.release_all()
    count = len(rig.sent)
    assert rig.sent[-1] == (0.0, 0.0, 0.0) and rig.targets[-1] is None
    rig.drive.release_all()
    assert len(rig.sent) == count and not rig.refused


def test_a_short_click_moves_nothing(rig, monkeypatch, spin):
    monkeypatch.setattr("telepresence.teleop.floor_goal.HOLD", 0.3)
    rig.drive.press(*AHEAD)
    assert rig.drive.target is not None and not rig.sent
    rig.drive.release()
    assert not rig.sent and rig.refused == [
        "Hold the button on the floor to drive there: the robot stops when you let go."
    ]
    rig.drive.press(*AHEAD)
    spin(lambda: rig.sent, "holding it drives")


def test_turns_first_when_the_place_is_beside_the_robot(rig):
    rig.drive.show_reading(body(yaw=-math.pi / 2))
    rig.drive.press(*AHEAD)
    vx, vy, wz = rig.sent[0]
    assert math.hypot(vx, vy) < 0.01 and wz == pytest.approx(0.5)


def test_the_place_stays_where_it_is_while_the_robot_moves(rig):
    rig.drive.press(*AHEAD)
    rig.drive.show_reading(body(x=1.5, y=0.5, yaw=0.3))
    distance, bearing = rig.drive.way()
    assert distance == pytest.approx(math.hypot(0.5, 0.5))
    assert bearing == pytest.approx(-math.pi / 4 - 0.3)


def test_slows_down_near_the_place_and_stops_at_it(rig, spin):
    rig.drive.press(*AHEAD)
    rig.drive.show_reading(body(x=1.84))
    spin(lambda: rig.sent[-1][0] == pytest.approx(0.16, abs=0.01), "it slows down")
    rig.drive.show_reading(body(x=2.0 - ARRIVED + 0.01))
    spin(lambda: rig.arrivals, "it is there")
    assert rig.sent[-1] == (0.0, 0.0, 0.0) and not rig.drive.driving


def test_dragging_moves_the_place(rig):
    rig.drive.press(*AHEAD)
    rig.drive.drag(320.0 - 105.0, AHEAD[1])
    assert rig.drive.target == pytest.approx((2.0, 0.4))


def test_a_click_on_the_sky_says_that_there_is_no_floor(rig):
    rig.drive.press(320.0, 100.0)
    assert not rig.sent and "no floor there" in rig.refused[0]


def test_an_old_picture_is_not_driven_by(rig):
    rig.age = 1.5
    rig.drive.press(*AHEAD)
    assert not rig.sent and "too old" in rig.refused[0]


def test_a_block_stops_it_and_gives_its_reason(rig):
    rig.drive.press(*AHEAD)
    rig.drive.set_block("The picture is lost.")
    assert rig.sent[-1] == (0.0, 0.0, 0.0) and rig.refused == ["The picture is lost."]
    rig.drive.press(*AHEAD)
    assert rig.refused[1:] == ["The picture is lost."] and rig.drive.target is None
    rig.drive.set_block("")
    rig.drive.press(*AHEAD)
    assert rig.drive.driving


def test_lost_odometry_stops_it(rig):
    rig.drive.show_reading(body(age=60.0))
    rig.drive.press(*AHEAD)
    assert "odometry" in rig.refused[0] and not rig.drive.driving
    assert not [velocity for velocity in rig.sent if any(velocity)]


def test_a_camera_without_calibration_is_refused_in_words(rig):
    rig.view = "The camera does not tell its calibration."
    rig.drive.press(*AHEAD)
    assert rig.refused == ["The camera does not tell its calibration."]


def test_a_way_that_stays_blocked_is_told_once_and_asked_for_on(rig, spin, monkeypatch):
    monkeypatch.setattr("telepresence.teleop.floor_goal.BLOCKED_PATIENCE", 0.2)
    rig.drive.press(*AHEAD)

    def blocked():
        rig.drive.show_reading(body())
        rig.drive.show_reading(safety("blocked"))
        return rig.refused

    spin(blocked, "it tells why")
    told = len(rig.sent)
    spin(lambda: blocked() and len(rig.sent) > told + 3, "it asks on")
    assert rig.refused == ["The way is blocked: a wall is ahead"] and any(rig.sent[-1])


def test_a_late_picture_or_lost_odometry_stops_and_it_goes_on_by_itself_while_held(rig, spin):
    def old_picture():
        rig.age = 1.5
        rig.drive.drag(*AHEAD)

    def fresh_picture():
        rig.age = 0.0

    interruptions = (
        (lambda: rig.drive.set_block("The picture is lost.", passing=True), lambda: rig.drive.set_block("")),
        (lambda: rig.drive.show_reading(body(age=60.0)), lambda: rig.drive.show_reading(body())),
        (old_picture, fresh_picture),
    )
    rig.drive.press(*AHEAD)
    for count, (interrupt, fix) in enumerate(interruptions, 1):
        assert rig.drive.driving
        interrupt()
        spin(lambda: not rig.drive.driving, "it stops")
        assert rig.sent[-1] == (0.0, 0.0, 0.0) and len(rig.refused) == count
        fix()
        spin(lambda: rig.drive.show_reading(body()) or rig.drive.driving, "it goes on")
        assert rig.drive.target == pytest.approx((2.0, 0.0)) and len(rig.resumed) == count
    rig.drive.set_block("The picture is lost.", passing=True)
    rig.drive.release_all()
    rig.drive.set_block("")
    sent, later = len(rig.sent), time.monotonic() + 0.15
    spin(lambda: time.monotonic() > later, "a while passes")
    assert len(rig.sent) == sent and rig.drive.target is None


def test_a_button_that_went_down_while_the_picture_was_late_counts_when_it_is_there(rig, spin):
    rig.drive.set_block("The picture is lost.", passing=True)
    rig.drive.press(*AHEAD)
    assert rig.refused == ["The picture is lost."] and not rig.sent
    rig.drive.set_block("")
    spin(lambda: rig.drive.show_reading(body()) or rig.drive.driving, "it drives")


def test_a_pointer_that_keeps_moving_keeps_driving(rig, spin):
    rig.drive.press(*AHEAD)
    sent = len(rig.sent)
    spin(lambda: rig.drive.drag(*AHEAD) or len(rig.sent) > sent + 2, "commands are repeated")


@pytest.mark.parametrize(("allowed", "tone"), [(0.0, "blocked"), (0.1, "slow"), (0.35, "free")])
def test_the_way_is_coloured_by_what_the_safety_layer_allows(rig, allowed, tone):
    rig.drive.show_reading(safety(allowed=allowed))
    rig.drive.press(*AHEAD)
    assert rig.drive.tone() == tone
