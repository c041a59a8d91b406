"""Range sensors and bumpers against walls whose place is known: x = ±4 m, y = ±3 m around the start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pepper_sim.body.description import LASER_ANGLES, LASER_MAX, LASER_MISS, SONAR_MAX, SONAR_MIN
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world


@pytest.fixture(name="pepper")
def _pepper():
    return Pepper(build_world("empty", [pepper_model()]), None)


def stand_at(pepper: Pepper, x: float, y: float, yaw: float) -> None:
    """Put the robot there at once and let every sensor read again."""
    with pepper.world.locked() as data:
        data.qpos[:2] = x, y
        data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        data.qvel[:6] = 0.0
    pepper.world.step(40)


def test_segment_one_is_the_leftmost(pepper):
    front = pepper.snapshot().laser["Front"]
    assert front.shape == (15, 2)
    assert np.degrees(LASER_ANGLES[0]) == pytest.approx(28.0)
    assert front[0, 1] > 0.0 > front[14, 1]
    bearings = np.degrees(np.arctan2(front[:, 1], front[:, 0]))
    assert np.diff(bearings) == pytest.approx(-4.0)


def test_lasers_measure_walls_in_their_own_frames(pepper):
    stand_at(pepper, 2.0, 0.0, 0.0)
    front = pepper.snapshot().laser["Front"]
    assert front[:, 0] == pytest.approx(2.0 - 0.0562, abs=0.08)
    # The left device looks 100.7 degrees to the left from (-0.018, 0.0899); put its wall 1 m away.
    stand_at(pepper, 0.0, 2.0, 0.0)
    left = pepper.snapshot().laser["Left"]
    yaw = 1.75728
    world_y = 2.0 + 0.0899 + left[:, 0] * math.sin(yaw) + left[:, 1] * math.cos(yaw)
    assert world_y == pytest.approx(3.0, abs=0.04)
    stand_at(pepper, 0.0, -2.0, 0.0)
    right = pepper.snapshot().laser["Right"]
    world_y = -2.0 - 0.0899 + right[:, 0] * math.sin(-yaw) + right[:, 1] * math.cos(-yaw)
    assert world_y == pytest.approx(-3.0, abs=0.04)


def test_a_miss_is_the_far_point(pepper):
    pepper.world.step(40)
    front = pepper.snapshot().laser["Front"]
    assert np.hypot(front[:, 0], front[:, 1]) == pytest.approx(LASER_MISS)
    assert LASER_MISS > LASER_MAX


def test_laser_readings_are_noisy_within_the_stated_size(pepper):
    stand_at(pepper, 2.0, 0.0, 0.0)
    readings = []
    for _ in range(60):
        pepper.world.step(32)
        readings.append(pepper.snapshot().laser["Front"][7, 0])
    assert 0.005 < np.std(readings) < 0.03
    assert np.mean(readings) == pytest.approx(2.0 - 0.0562, abs=0.01)


def test_lasers_are_read_every_160_ms_and_sonars_every_100_ms(pepper):
    stand_at(pepper, 2.0, 0.0, 0.0)
    laser, sonar = set(), []
    for _ in range(400):
        pepper.world.step(1)
        laser.add(float(pepper.snapshot().laser["Front"][7, 0]))
        sonar.append(pepper.snapshot().sonar["Front"])
    assert 10 <= len(laser) <= 13
    changes = np.flatnonzero(np.diff(sonar))
    assert len(changes) == 0 or (np.diff(changes) % 20 == 0).all()


def test_sonars_measure_the_nearest_echo(pepper):
    stand_at(pepper, 2.0, 0.0, 0.0)
    assert pepper.snapshot().sonar["Front"] == pytest.approx(2.0 - 0.07, abs=0.09)
    stand_at(pepper, -2.5, 0.0, 0.0)
    assert pepper.snapshot().sonar["Back"] == pytest.approx(1.5 - 0.072, abs=0.09)
    assert pepper.snapshot().sonar["Front"] == SONAR_MAX


def test_sonars_do_not_hear_the_floor(pepper):
    stand_at(pepper, -3.0, 0.0, 0.0)
    assert pepper.snapshot().sonar["Front"] == SONAR_MAX


def test_sonars_have_a_nearest_reading(pepper):
    stand_at(pepper, 3.8, 0.0, 0.0)
    assert pepper.snapshot().sonar["Front"] == SONAR_MIN


def test_ground_lasers_see_the_floor_and_what_stands_on_it(pepper):
    pepper.world.step(40)
    floor = pepper.snapshot()
    assert floor.shovel.shape == (3, 2)
    # 0.1585 m high, 14.15 degrees down: the middle ray meets the floor 0.629 m ahead of the projector.
    assert floor.shovel[1] == pytest.approx((0.1129 - 0.0562 + 0.629, 0.0), abs=0.03)
    assert floor.shovel[0, 1] > 0.1 > -0.1 > floor.shovel[2, 1]
    assert floor.vertical["Left"].shape == (2,)
    stand_at(pepper, 3.6, 0.0, 0.0)
    assert pepper.snapshot().shovel[:, 0] == pytest.approx(0.4 - 0.0562, abs=0.03)


@pytest.mark.parametrize(
    ("x", "yaw", "seen"),
    [
        (3.5, 0.0, set()),  # along either ray the wall is 0.64 m away,
        (3.75, 0.0, {"Left", "Right"}),  # 0.28 m,
        (3.45, -45.0, set()),  # along the left one 0.46 m,
        (3.6, -45.0, {"Left"}),  # 0.31 m,
        (3.6, 45.0, {"Right"}),
    ],
)
def test_infrared_spots_see_what_is_near_at_45_degrees(pepper, x, yaw, seen):
    stand_at(pepper, x, 0.0, math.radians(yaw))
    assert {side for side, near in pepper.snapshot().infrared.items() if near} == seen


@pytest.mark.parametrize(
    ("velocity", "pressed"),
    [
        ((0.35, 0.0), {"FrontLeft", "FrontRight"}),
        ((-0.35, 0.0), {"Back"}),
        ((0.0, 0.35), {"FrontLeft"}),
        ((0.0, -0.35), {"FrontRight"}),
    ],
)
def test_bumpers_feel_the_wall_they_touch(pepper, velocity, pressed):
    pepper.security.enabled = False
    stand_at(
        pepper,
        *((3.4, 0.0) if velocity[0] > 0 else (-3.4, 0.0) if velocity[0] else (0.0, math.copysign(2.5, velocity[1]))),
        0.0,
    )
    assert not any(pepper.snapshot().bumpers.values())
    pepper.set_velocity(*velocity, 0.0)
    pepper.world.step(500)
    assert {name for name, value in pepper.snapshot().bumpers.items() if value} == pressed
    pepper.set_velocity(-velocity[0], -velocity[1], 0.0)
    pepper.world.step(300)
    assert not any(pepper.snapshot().bumpers.values())
