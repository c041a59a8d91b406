"""The wildest animations in physics, faster than real time: the joints follow, and the robot does not tip over."""

import pytest

from pepper_sim.animations import library
from pepper_sim.animations.generator import playable
from pepper_sim.body.postures import STAND
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world


@pytest.fixture(name="pepper", scope="module")
def _pepper():
    return Pepper(build_world("empty", [pepper_model()]), None)


@pytest.mark.parametrize("name", ["Waiting/Headbang_1", "Waiting/Helicopter_1", "Gestures/No_3", "Gestures/BowShort_1"])
def test_the_robot_carries_it_out(pepper, name):
    done = pepper.follow(playable(library.curves(f"animations/Stand/{name}"), STAND, STAND))
    error = tilt = 0.0
    while not done.done() and pepper.world.tick < 100_000:
        pepper.world.step(20)
        now = pepper.snapshot()
        moving = {joint: abs(now.joint_positions[joint] - now.joint_setpoints[joint]) for joint in STAND}
        error = max(error, *moving.values())
        tilt = max(tilt, *map(abs, pepper.truth()[3:5]))
    assert done.result(0) is True
    assert error < 0.08 and tilt < 0.01 and not pepper.snapshot().fallen
