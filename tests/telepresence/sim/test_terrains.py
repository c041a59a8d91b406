"""What the terrains do to robots on wheels: the robots themselves drive over them."""

from __future__ import annotations

import math

import mujoco
import pytest

from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from robotino_sim.models import robotino_model
from robotino_sim.robot import Robotino
from telepresence.sim.scene import build_world
from telepresence.sim.simulated_robot import BodyState, read_pose

SPEED = 0.3


def drive(kind: str, scene: str, x: float, y: float, distance: float) -> list[BodyState]:
    """Poses, ten a second, of a robot that is set down at (x, y) and drives `distance` [m] along x."""
    make, model = {"pepper": (Pepper, pepper_model), "robotino": (Robotino, robotino_model)}[kind]
    world = build_world(scene, [model("r/")])
    robot = make(world, None, "r/")
    start = int(world.model.joint("r/root").qposadr[0])
    with world.locked() as data:
        data.qpos[start : start + 7] = x, y, 0.002, 1.0, 0.0, 0.0, 0.0
        mujoco.mj_forward(world.model, data)
    poses = []
    for _ in range(round(10.0 * distance / SPEED)):
        robot.set_velocity(SPEED, 0.0, 0.0)
        for _ in range(2):
            robot.set_velocity(SPEED, 0.0, 0.0)
            world.step(10)
        poses.append(read_pose(world, "r/"))
    world.close()
    return poses


@pytest.mark.parametrize("kind", ["pepper", "robotino"])
def test_a_ramp_of_five_degrees_is_climbed(kind):
    poses = drive(kind, "ramp", -2.0, 0.0, 2.8)
    assert max(pose.z for pose in poses) == pytest.approx(0.175, abs=0.01)
    assert math.degrees(-min(pose.pitch for pose in poses)) == pytest.approx(5.0, abs=0.7), "nose up is negative pitch"
    assert all(abs(pose.y) < 0.1 for pose in poses)


@pytest.mark.parametrize("kind", ["pepper", "robotino"])
@pytest.mark.parametrize(
    ("lane", "edge", "height"), [(1.9, 0.0, 0.010), (-1.9, -0.8, 0.005)], ids=["threshold", "carpet"]
)
def test_a_threshold_and_a_carpets_edge_are_felt_and_passed(kind, lane, edge, height):
    poses = drive(kind, "ramp", edge - 0.5, lane, 1.2)
    assert poses[-1].x > edge + 0.4, "it got over"
    assert max(pose.z for pose in poses) == pytest.approx(height, abs=0.004)
    assert max(abs(pose.pitch) for pose in poses) > 0.004


@pytest.mark.parametrize("kind", ["pepper", "robotino"])
def test_rough_ground_shakes_and_does_not_topple(kind):
    poses = drive(kind, "rough", -1.6, 0.0, 1.6)
    assert poses[-1].x > -0.4
    tilts = [math.hypot(pose.roll, pose.pitch) for pose in poses]
    assert 0.01 < max(tilts) < math.radians(8.0)


def test_the_flat_is_flat():
    poses = drive("robotino", "flat", 0.0, -2.0, 1.0)
    assert max(abs(pose.z) for pose in poses) < 0.001
    assert max(math.hypot(pose.roll, pose.pitch) for pose in poses) < 0.005
