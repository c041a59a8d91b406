"""How the head is turned, step by step, without a robot."""

from __future__ import annotations

import math

import pytest
from naoqi_driver.head import (
    AHEAD_TIME,
    FASTEST,
    JOINTS,
    LARGEST_YAW,
    PATIENCE,
    TOP_SPEED,
    HeadMotion,
    limits_at,
    reachable,
    yaw_of_way,
)

from telepresence.geometry import Velocity
from telepresence.teleop.looking import VALID, Look, Manner

PERIOD = 0.05
AHEAD = 0.15


class Head:
    """Joints that do what `setAngles` says."""

    def __init__(self, yaw=0.0, pitch=AHEAD):
        self.motion, self.now = HeadMotion(AHEAD), 100.0
        self.angles = dict(zip(JOINTS, (yaw, pitch), strict=True))
        self.targets = dict(self.angles)
        self.speeds = dict.fromkeys(JOINTS, 0.0)
        self.motion.place(yaw, pitch)
        self.path = []

    @property
    def yaw(self):
        return self.angles["HeadYaw"]

    @property
    def pitch(self):
        return self.angles["HeadPitch"]

    def live(self, seconds, look=None, velocity=None):
        """Let time pass, with a look and a velocity that are repeated."""
        for _ in range(round(seconds / PERIOD)):
            if look is not None:
                self.motion.look(look, self.now)
            if velocity is not None:
                self.motion.drives(velocity, self.now)
            for step in self.motion.step(self.now):
                self.targets[step.joint] = step.angle
                self.speeds[step.joint] = step.fraction * TOP_SPEED[JOINTS.index(step.joint)]
            for joint, angle in self.angles.items():
                reach = self.speeds[joint] * PERIOD
                self.angles[joint] = angle + max(-reach, min(reach, self.targets[joint] - angle))
            self.now += PERIOD
            self.path.append((self.yaw, self.pitch))


def test_the_documented_limits_depend_on_the_yaw():
    assert limits_at(0.0) == pytest.approx([math.radians(-40.5), math.radians(25.5)])
    assert limits_at(math.radians(-61.6)) == pytest.approx([math.radians(-35.2), math.radians(20.9)])
    assert limits_at(2.0).down == pytest.approx(math.radians(13.5))
    assert reachable(9.0, 9.0) == pytest.approx([LARGEST_YAW, math.radians(13.5)])


def test_a_rate_turns_the_head_as_fast_and_ends_when_it_is_not_repeated():
    head = Head()
    head.live(1.0, Look(Manner.RATE, 0.6, 0.0))
    assert head.yaw == pytest.approx(0.6, abs=0.06) and head.pitch == AHEAD
    head.live(VALID + AHEAD_TIME + PERIOD)
    stood = head.yaw
    head.live(1.0)
    assert head.yaw == stood <= 0.6 + 0.6 * (VALID + AHEAD_TIME + PERIOD)


def test_a_goal_is_reached_and_kept():
    head = Head()
    head.live(1.2, Look(Manner.GOAL, -1.0, 0.3))
    assert (head.yaw, head.pitch) == pytest.approx((-1.0, 0.3), abs=0.02)
    head.live(1.0)
    assert (head.yaw, head.pitch) == pytest.approx((-1.0, 0.3), abs=0.02)
    fastest = max(abs(b[0] - a[0]) for a, b in zip(head.path, head.path[1:], strict=False)) / PERIOD
    assert fastest <= FASTEST[0] * 1.1


@pytest.mark.parametrize("start", [(0.0, 0.44), (-2.0, 0.2)])
def test_no_way_to_a_goal_leaves_the_limits(start):
    head = Head(*start)
    head.live(2.0, Look(Manner.GOAL, 2.0, 0.44))
    assert head.yaw == pytest.approx(2.0, abs=0.02)
    assert all(pitch <= limits_at(yaw).down + 0.01 for yaw, pitch in head.path)


def test_straight_ahead():
    head = Head(1.5, -0.3)
    head.live(1.5, Look(Manner.AHEAD))
    assert (head.yaw, head.pitch) == pytest.approx((0.0, AHEAD), abs=0.02)


@pytest.mark.parametrize(
    ("velocity", "yaw"),
    [((0.2, 0.0, 0.0), 0.0), ((0.0, 0.2, 0.0), math.pi / 2), ((0.0, 0.0, -0.5), -0.3), ((-0.2, 0.0, 0.0), 0.0)],
)
def test_where_the_robot_drives(velocity, yaw):
    assert yaw_of_way(Velocity(*velocity)) == pytest.approx(yaw)


def test_looking_where_i_drive_comes_back_ahead_after_a_moment():
    head = Head()
    head.live(2.0, Look(Manner.WAY), Velocity(0.0, -0.2, 0.0))
    assert head.yaw == pytest.approx(-math.pi / 2, abs=0.02)
    head.live(PATIENCE * 0.9, Look(Manner.WAY))
    assert head.yaw == pytest.approx(-math.pi / 2, abs=0.02)
    head.live(3.0, Look(Manner.WAY))
    assert head.yaw == pytest.approx(0.0, abs=0.02)


def test_a_head_whose_place_is_unknown_is_not_turned():
    motion = HeadMotion(AHEAD)
    motion.look(Look(Manner.RATE, 1.0, 0.0), 0.0)
    assert motion.needs_angles and motion.step(0.0) == []
