"""Several robots in one world: who is in it, where they start, what they see of each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import pytest

from pepper_sim.simulation import SimulatedPepper
from robotino_sim.simulation import SimulatedRobotino
from telepresence.sim.camera import Cameras
from telepresence.sim.placement import SPACING, FreePlaces
from telepresence.sim.scene import build_world
from telepresence.sim.simulated_robot import find_kind, kinds, read_pose
from telepresence.sim.simulation import RobotRequest, Simulation, parse_robots
from telepresence.sim.world import World

APART = 0.75
"""Between the middles of two robots that face each other [m]."""


def test_a_robot_is_named_by_kind_name_and_port():
    wishes = parse_robots(["pepper", "pepper", "robotino:rto3:8081", "pepper:anna:0"], {"rto3": {"laser": True}})
    assert [(request.kind, request.name, request.port) for request in wishes] == [
        ("pepper", "pepper", 9559),
        ("pepper", "pepper_2", 0),
        ("robotino", "rto3", 8081),
        ("pepper", "anna", 0),
    ]
    assert wishes[2].options == {"laser": True} and wishes[0].options == {}


def test_several_that_are_alike_are_numbered():
    wishes = parse_robots(["robotino*3:cart:8100", "pepper*2"])
    assert [(request.name, request.port) for request in wishes] == [
        *(("cart_1", 8100), ("cart_2", 8101), ("cart_3", 8102)),
        *(("pepper_1", 0), ("pepper_2", 0)),
    ]


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["robotino*0"], "count is a number from 1"),
        (["cat"], "pepper, robotino"),
        (["pepper:Anna"], "small letters"),
        (["pepper:a", "robotino:a"], "both be called 'a'"),
        (["pepper:a:many"], "0 to 65535"),
        (["pepper:a:70000"], "0 to 65535"),
    ],
)
def test_what_is_no_robot_is_refused_with_the_reason(words, hint):
    with pytest.raises(ValueError, match=hint):
        parse_robots(words)


def test_an_unknown_setting_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match=r"robotino has no setting 'wings'.*laser"):
        Simulation([RobotRequest("robotino", "a", 0, {"wings": 2})], "empty")


def test_kinds_are_found_by_name():
    assert {"pepper", "robotino"} <= set(kinds())
    assert find_kind("pepper") is SimulatedPepper


@pytest.mark.parametrize("scene", ["apartment", "arena", "flat", "ramp", "rough"])
def test_robots_that_share_a_spawn_point_stand_side_by_side_on_free_floor(scene):
    places = FreePlaces(scene)
    names = [(kind, f"{kind}{i}/") for kind in ("pepper", "robotino") for i in (0, 1)]
    robots = [find_kind(kind)(prefix, places.find(f"spawn_{kind}")) for kind, prefix in names]
    world = build_world(scene, [robot.model for robot in robots])
    poses = [read_pose(world, robot.model.prefix) for robot in robots]
    for i, a in enumerate(poses):
        assert all(math.hypot(a.x - b.x, a.y - b.y) > SPACING - 0.01 for b in poses[:i])
    world.step(200)
    for robot, start in zip(robots, poses, strict=True):
        pose = read_pose(world, robot.model.prefix)
        assert math.hypot(pose.x - start.x, pose.y - start.y) < 0.02, f"{robot.model.prefix} was pushed away"
        assert abs(pose.roll) < 0.05 and abs(pose.pitch) < 0.05
    world.close()


def test_a_scene_that_is_full_says_so():
    places = FreePlaces("empty")
    with pytest.raises(ValueError, match="no room for robot number"):
        for _ in range(200):
            places.find("spawn_pepper")


class Pair:
    """A Pepper at the origin that looks at a Robotino, which looks back; the world is stepped by the test."""

    def __init__(self) -> None:
        self.pepper, self.robotino = SimulatedPepper("pepper/"), SimulatedRobotino("rto/", laser=True)
        self.world: World = build_world("empty", [self.pepper.model, self.robotino.model])
        self.cameras = Cameras(self.world)
        for robot in (self.pepper, self.robotino):
            robot.enter(self.world, self.cameras, 0)

    def place_robotino(self, x: float, y: float, yaw: float) -> None:
        start = int(self.world.model.joint("rto/root").qposadr[0])
        with self.world.locked() as data:
            data.qpos[start : start + 7] = x, y, 0.0, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
            mujoco.mj_forward(self.world.model, data)

    def close(self) -> None:
        for robot in (self.pepper, self.robotino):
            robot.close()
        self.cameras.close()
        self.world.close()


@pytest.fixture(scope="module")
def pair() -> Iterator[Pair]:
    made = Pair()
    yield made
    made.close()


@pytest.fixture
def facing(pair) -> Pair:
    pair.world.reset()
    pair.place_robotino(APART, 0.0, math.pi)
    pair.world.step(100)
    return pair


def test_each_is_seen_by_the_sensors_of_the_other(facing):
    pepper, robotino = facing.pepper.robot.snapshot(), facing.robotino.robot.snapshot()
    nearest = min(math.hypot(x, y) for x, y in pepper.laser["Front"])
    assert 0.1 < nearest < APART, "Pepper's front laser sees the Robotino"
    assert pepper.sonar["Front"] < APART
    in_front = (robotino.distances[8], *robotino.distances[:2])
    assert min(in_front) < 0.40, "infrared sees Pepper's foot"
    assert robotino.distances[4] == pytest.approx(0.41)
    ahead = robotino.scan.ranges[len(robotino.scan.ranges) // 2]
    assert 0.1 < ahead < APART, "the laser scanner sees Pepper"


def test_without_the_other_there_is_nothing_to_see(facing):
    facing.place_robotino(-2.0, -2.0, 0.0)
    facing.world.step(100)
    assert facing.pepper.robot.snapshot().sonar["Front"] > 1.0
    assert min(facing.robotino.robot.snapshot().distances) > 0.40


def test_one_drives_and_the_other_stands(facing):
    facing.place_robotino(0.0, -1.5, 0.0)
    before = read_pose(facing.world, "pepper/")
    for _ in range(20):
        facing.robotino.robot.set_velocity(0.2, 0.0, 0.0)
        facing.world.step(10)
    assert read_pose(facing.world, "rto/").x > 0.1
    after = read_pose(facing.world, "pepper/")
    assert math.hypot(after.x - before.x, after.y - before.y) < 0.001
    facing.pepper.robot.set_velocity(0.2, 0.0, 0.0)
    stopped = read_pose(facing.world, "rto/")
    facing.world.step(200)
    assert read_pose(facing.world, "pepper/").x > 0.1
    assert abs(read_pose(facing.world, "rto/").x - stopped.x) < 0.06, "its watchdog stopped it"


def test_velocity_is_told_along_the_robots_own_axes(facing):
    facing.place_robotino(0.0, -1.5, math.pi / 2)
    for _ in range(20):
        facing.robotino.robot.set_velocity(0.2, 0.0, 0.5)
        facing.world.step(10)
    pose = read_pose(facing.world, "rto/")
    assert pose.velocity[0] == pytest.approx(0.2, abs=0.01) and abs(pose.velocity[1]) < 0.02
    assert pose.turning[2] == pytest.approx(0.5, abs=0.02)


def test_a_restart_puts_all_of_them_back(facing):
    facing.pepper.robot.set_velocity(0.2, 0.0, 0.0)
    facing.world.step(200)
    facing.world.reset()
    pose = read_pose(facing.world, "rto/")
    assert (pose.x, pose.y) == pytest.approx((0.0, -1.5), abs=0.001)
    assert read_pose(facing.world, "pepper/").x == pytest.approx(0.0, abs=0.001)
    facing.world.step(100)
    assert read_pose(facing.world, "pepper/").x == pytest.approx(0.0, abs=0.001), "and none drives on"
