"""The walker in the world: walks, freezes, falls, starts again."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from telepresence.sim.walker.gait import GAITS

HELD = 0.003
"""A frozen robot stays where it is within this [m]."""


@pytest.mark.parametrize("scene", ["flat", "rough"])
@pytest.mark.parametrize("direction", [1, -1], ids=["forward", "backward"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_walks_a_metre_and_freezes(stepped: Callable, scene: str, direction: int, seed: int):
    robot = stepped(scene, seed)
    robot.scatter(seed)
    start = robot.walker.truth()
    robot.walker.move(direction)
    robot.wait(5.0)
    robot.walker.move(0)
    robot.wait(0.5)
    assert direction * robot.ahead(start) >= 1.0
    assert not robot.walker.snapshot().fallen
    held, setpoints = robot.walker.truth(), robot.setpoints()
    robot.wait(3.0)
    assert math.dist(held[:3], robot.walker.truth()[:3]) < HELD
    assert (robot.setpoints() == setpoints).all(), "the frozen gait moved a joint"


@pytest.mark.parametrize("gait", GAITS)
def test_climbs_the_ramp_and_holds_on_it(stepped: Callable, gait: str):
    robot = stepped("ramp", gait=gait)
    robot.walk(GAITS[gait].cruise, 0.0, 0.0, 2.5 / GAITS[gait].cruise)
    robot.wait(1.0)
    x, _, z, *_ = held = robot.walker.truth()
    assert z > 0.23 and x < 0.4, "it should stand on the slope by now"
    robot.wait(3.0)
    assert math.dist(held[:3], robot.walker.truth()[:3]) < HELD


def test_keeps_its_heading_and_knows_how_far_it_came(stepped: Callable):
    robot = stepped()
    robot.walk(0.25, 0.0, 0.0, 8.0)
    truth, odometry = robot.walker.truth(), robot.walker.snapshot().odometry
    assert abs(truth[5]) < math.radians(3.0)
    assert odometry[0] == pytest.approx(truth[0] + 1.5, rel=0.05)


def test_turns_left_by_the_angle_asked_for(stepped: Callable):
    robot = stepped()
    robot.walk(0.0, 0.0, 0.5, 3.0)
    assert robot.walker.truth()[5] == pytest.approx(1.5, abs=0.25)


def test_silence_freezes_it(stepped: Callable):
    robot = stepped()
    robot.walker.set_velocity(0.25, 0.0, 0.0)
    robot.wait(0.45)
    assert robot.walker.snapshot().walking
    robot.wait(0.15)
    assert not robot.walker.snapshot().walking


def test_movement_goes_on_without_repetition_until_the_world_starts_again(stepped: Callable):
    robot = stepped()
    robot.walker.move(1)
    robot.wait(2.0)
    assert robot.walker.snapshot().walking
    robot.world.reset()
    robot.wait(0.5)
    assert not robot.walker.snapshot().walking


def test_a_gait_chosen_in_mid_walk_changes_the_speed_at_the_next_start(stepped: Callable):
    robot = stepped()

    def speed() -> float:
        robot.walker.move(1)
        robot.wait(1.0)
        start = robot.walker.truth()
        robot.walker.move(1)
        robot.wait(1.0)
        return robot.ahead(start)

    trot = speed()
    robot.walker.choose_gait("crawl")
    assert speed() == pytest.approx(trot, rel=0.2)
    robot.walker.move(0)
    robot.wait(0.5)
    assert speed() < 0.5 * trot


def test_a_restart_in_mid_step_gives_the_start_pose_and_phase_zero_each_time(stepped: Callable):
    robot = stepped("rough")
    start = robot.walker.truth()
    for seconds in (0.13, 1.21, 0.57):
        robot.walker.move(1)
        robot.wait(seconds)
        robot.world.reset()
        assert robot.walker.snapshot().phase == 0.0
        robot.wait(0.5)
        assert np.abs(np.subtract(robot.walker.truth(), start)).max() < 0.001
        assert robot.walker.snapshot().odometry[:2] == pytest.approx((0.0, 0.0), abs=0.01)


def test_the_same_seed_walks_the_same_way(stepped: Callable):
    ends = []
    for _ in range(2):
        robot = stepped("rough", 7)
        robot.walk(0.25, 0.0, 0.0, 2.0)
        ends.append(robot.walker.truth())
    assert ends[0] == ends[1]


def test_a_walker_on_its_back_says_so_goes_limp_and_a_restart_puts_it_on_its_feet(stepped: Callable, caplog):
    robot = stepped()
    robot.walk(0.25, 0.0, 0.0, 1.0)
    assert robot.walker.snapshot().velocity[0] > 0.1
    start = robot.world.model.joint("walker/root").qposadr[0]
    with robot.world.locked() as data:
        data.qpos[start + 2 : start + 7] = 0.3, 0.0, 1.0, 0.0, 0.0
        mujoco.mj_forward(robot.world.model, data)
    robot.walk(0.25, 0.0, 0.0, 2.0)
    lying = robot.walker.snapshot()
    assert lying.fallen and not lying.walking and max(map(abs, lying.torques)) < 1.0
    assert math.hypot(*lying.velocity) < 0.02 and lying.odometry[2] == lying.attitude[2]
    assert caplog.messages == ["walker has fallen and lies limp until the world is restarted"]
    robot.world.reset()
    robot.wait(0.5)
    assert not robot.walker.snapshot().fallen and robot.walker.truth()[2] > 0.17


@pytest.mark.parametrize("velocity", [(math.nan, 0.0, 0.0), (0.0, math.inf, 0.0)])
def test_a_velocity_that_is_no_number_is_refused(stepped: Callable, velocity: tuple[float, float, float]):
    robot = stepped("empty")
    with pytest.raises(ValueError, match="finite"):
        robot.walker.set_velocity(*velocity)
    robot.wait(0.2)
    assert not robot.walker.snapshot().walking


def test_mistakes_are_explained(stepped: Callable):
    with pytest.raises(ValueError, match=r"gallop.*trot, crawl"):
        stepped("empty", gait="gallop")
    with pytest.raises(ValueError, match="positive"):
        stepped("empty", watchdog=0.0)
    with pytest.raises(RuntimeError, match="without cameras"):
        stepped("empty").walker.subscribe_camera(640, 480, 10.0)
