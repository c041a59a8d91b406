"""The robot's laser as its gate on the robot has it: where things are, and how fast the robot may drive there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rto_bringup.onboard.laser_beams import LASER, ranges_of_beams
from rto_bringup.onboard.robotino_base import RobotinoBase
from rto_bringup.onboard.sensors import Reading
from rto_node.client import Scan
from rto_node.robot_facts import LASER_MOUNT, NOTHING

from robotino_sim import laser
from telepresence.drive.pilots import PilotVelocity
from telepresence.safety import SECTORS, UNKNOWN, Odometry

NOTHING_NEAR = (NOTHING,) * 9
PERIOD = 0.05
INFRARED_SPEED = 0.20
BEARINGS = laser.ANGLE_MIN + laser.ANGLE_INCREMENT * np.arange(laser.COUNT)
BACKGROUND = 2.5
"""A wall all around that limits nothing [m]."""


def scan(ranges) -> Scan:
    """What the simulated robot's scanner would answer."""
    limits = (laser.RANGE_MIN, laser.RANGE_MAX)
    return Scan(1, laser.ANGLE_MIN, laser.ANGLE_INCREMENT, 0.0, laser.PERIOD, *limits, tuple(map(float, ranges)))


def with_box(degrees: float, distance: float = 0.35) -> np.ndarray:
    """Ranges to a wall and a box 0.10 m wide before it, `distance` from the robot's middle [m]."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    face = np.array([c, s]) * distance + np.linspace(-0.05, 0.05, 201)[:, None] * (-s, c) - (LASER_MOUNT, 0.0)
    ranges = np.full(laser.COUNT, BACKGROUND)
    ray = np.rint((np.arctan2(face[:, 1], face[:, 0]) - laser.ANGLE_MIN) / laser.ANGLE_INCREMENT).astype(int)
    met = (ray >= 0) & (ray < laser.COUNT)
    np.minimum.at(ranges, ray[met], np.hypot(*face.T)[met])
    return ranges


class Driven:
    """A pilot whose commands come in time, and a robot with a laser that stands still; its readings are invented."""

    cut, careful = False, False

    def __init__(self, monkeypatch) -> None:
        self.base = RobotinoBase("127.0.0.1:1", laser=True)
        monkeypatch.setattr(self.base, "_write", lambda _velocity: None)
        self.base._sensors.problem = ""
        self.noise = np.random.default_rng(1)
        self.now = 10.0

    def deadline(self) -> float:
        return math.inf

    def run(self, seconds: float, ranges: np.ndarray, velocity: tuple[float, float]):
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            seen = scan(np.where(ranges > 0.0, ranges + 0.002 * self.noise.standard_normal(laser.COUNT), 0.0))
            self.base._store(Reading(self.now, NOTHING_NEAR, False, Odometry(0.0, 0.0, 0.0, self.now), seen))
            outcome = self.base.step(self.now, PilotVelocity(*velocity, 0.0, self.now), None, self)
        return outcome


@pytest.fixture
def driven(monkeypatch):
    return Driven(monkeypatch)


@pytest.mark.parametrize("degrees", [0, 90, -90])
def test_a_box_is_where_the_laser_sees_it(driven, degrees):
    allowed = driven.run(1.0, with_box(degrees), (0.0, 0.0)).allowed
    ahead = SECTORS * degrees // 360 % SECTORS
    points = driven.base._gate.obstacles()
    assert len(points)
    away = np.angle(np.exp(1j * (np.arctan2(points[:, 1], points[:, 0]) - math.radians(degrees))))
    assert np.abs(away).max() < math.radians(15.0)
    assert np.hypot(*points.T).min() == pytest.approx(0.35, abs=0.03)
    assert allowed[ahead] == min(allowed) < INFRARED_SPEED
    assert allowed[(ahead + SECTORS // 2) % SECTORS] >= INFRARED_SPEED - 1e-9


def test_ahead_the_laser_permits_more_than_backwards_where_it_does_not_look(driven):
    ranges = np.full(laser.COUNT, 6.0)
    assert driven.run(1.0, ranges, (0.5, 0.0)).given[0] > 0.45
    backwards = driven.run(1.0, ranges, (-0.5, 0.0))
    assert backwards.given[0] == pytest.approx(-INFRARED_SPEED)
    assert backwards.state == "limited" and "Fastest that the sensors there are good for" in backwards.reason


def test_each_beam_has_its_nearest_return_and_those_behind_have_none():
    ranges = np.full(laser.COUNT, 2.0)
    ranges[220] = 0.5  # straight ahead
    beams = dict(zip(np.degrees(LASER.bearings).round(1).tolist(), ranges_of_beams(scan(ranges)), strict=True))
    assert min(beams[2.5], beams[-2.5]) == pytest.approx(0.58, abs=0.001)
    assert beams[87.5] == pytest.approx(2.0, abs=0.1) == beams[-87.5]
    assert beams[177.5] == beams[-177.5] == beams[122.5] == UNKNOWN
    assert all(map(math.isfinite, beams.values()))


def test_a_scanner_that_has_gone_blind_permits_no_more_than_the_infrared_and_erases_nothing(driven):
    box = with_box(0.0)
    driven.run(1.0, box, (0.0, 0.0))
    remembered = len(driven.base._gate.obstacles())
    assert remembered
    blind = np.zeros(laser.COUNT)
    driven.run(0.1, blind, (0.0, 0.0))
    assert len(driven.base._gate.obstacles()) == remembered
    outcome = driven.run(3.0, blind, (0.0, 0.0))
    assert len(driven.base._gate.obstacles()) == remembered
    assert max(outcome.allowed) <= INFRARED_SPEED + 1e-9 and outcome.allowed[0] < INFRARED_SPEED
    outcome = driven.run(1.0, blind, (0.0, 0.5))
    assert outcome.given[1] <= INFRARED_SPEED + 1e-9
    assert "The laser has no valid reading" in outcome.reason


@pytest.mark.parametrize("ranges", [0.0, 0.03, laser.RANGE_MAX], ids=["nothing", "a cap", "the end of its reach"])
def test_a_scan_without_a_return_of_anything_is_blind(ranges):
    assert set(ranges_of_beams(scan(np.full(laser.COUNT, ranges)))) == {UNKNOWN}


def sector(ranges: np.ndarray) -> float:
    """The beam at 2.5 degrees."""
    return ranges_of_beams(scan(ranges))[int(np.abs(LASER.bearings - math.radians(2.5)).argmin())]


def test_a_ray_without_a_return_is_free_only_between_far_ones():
    within = np.abs(np.degrees(BEARINGS) - 2.5) < 2.6
    near, far = np.full(laser.COUNT, 2.0), np.full(laser.COUNT, 6.0)
    near[within] = far[within] = 0.0
    assert sector(near) == UNKNOWN, "something black, for all that is known"
    assert sector(far) > LASER.max_range, "a few rays that missed a far wall"
    far[np.abs(np.degrees(BEARINGS) - 2.5) < 12.0] = 0.0
    assert sector(far) == UNKNOWN, "too many to be chance"


def test_one_ray_that_meets_something_near_is_believed():
    ranges = np.zeros(laser.COUNT)
    ranges[:100] = 6.0
    ranges[int(np.abs(BEARINGS - math.radians(2.5)).argmin())] = 0.5
    assert sector(ranges) == pytest.approx(0.58, abs=0.001)
