"""What follows people gives way to a pilot at every moment. Physics is real, time is stepped."""

from types import SimpleNamespace

import pytest

from pepper_sim.models import pepper_model
from pepper_sim.naoqi.motion_tasks import MotionTasks
from pepper_sim.naoqi.people.following_base import FollowingBase
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world


@pytest.fixture
def robot():
    return Pepper(build_world("empty", [pepper_model()]), None)


@pytest.fixture
def follower(robot):
    return FollowingBase(robot, SimpleNamespace(tasks=MotionTasks()))


@pytest.mark.parametrize("driving", [False, True])
@pytest.mark.parametrize(
    ("pilot", "velocity"),
    [
        (lambda robot: robot.set_velocity(-0.2, 0.0, 0.0), -0.2),
        (lambda robot: robot.move_to([(-5.0, 0.0, 0.0)]), -0.35),
        (lambda robot: robot.stop_move(), 0.0),
    ],
)
def test_a_pilot_who_comes_while_it_looks_whether_the_base_is_free_drives(
    robot, follower, monkeypatch, driving, pilot, velocity
):
    if driving:
        follower.drive(0.1, 0.0)
        assert follower.driving
    looked = FollowingBase.free.fget
    monkeypatch.setattr(FollowingBase, "free", property(lambda self: (looked(self), pilot(robot))[0]))
    follower.drive(0.2, 0.0)
    assert not follower.driving
    follower.halt()
    robot.world.step(400)
    assert robot.snapshot().velocity[0] == pytest.approx(velocity, abs=0.02)


def test_it_stops_what_it_began(robot, follower):
    follower.drive(0.2, 0.0)
    robot.world.step(200)
    assert robot.snapshot().velocity[0] == pytest.approx(0.2, abs=0.02)
    follower.halt()
    robot.world.step(200)
    assert not robot.snapshot().moving and follower.free
