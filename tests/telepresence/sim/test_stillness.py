"""What stands still is not measured again, and whatever moves is."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from telepresence.sim.rays import Rays, fan
from telepresence.sim.stillness import STILL, Stillness

ROOM = """
<mujoco>
  <worldbody>
    <geom name="wall" type="box" pos="2.05 0 0" size=".05 5 5"/>
    <body name="robot"><freejoint/>
      <geom size=".2"/><site name="eye"/>
      <body name="arm" pos="0 0 1"><joint name="shoulder"/><geom size=".05"/></body>
    </body>
    <body name="person" mocap="true" pos="1 1 0"><geom size=".2"/></body>
    <body name="parcel" pos="1 -1 0"><freejoint name="parcel"/><geom size=".1"/></body>
    <body name="lamp" pos="0 3 0"><geom size=".1"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(name="room")
def _room():
    model = mujoco.MjModel.from_xml_string(ROOM)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture
def rest(room) -> Stillness:
    model, data = room
    rays = Rays(model, [("eye", fan(np.zeros(1)))], 5.0)
    rest = Stillness(rays.body, rays.others)
    assert not rest.holds(data), "nothing was measured yet"
    assert [rest.holds(data) for _ in range(3)] == [False, True, True], "once more, as the robot came to rest"
    return rest


def moves(data, what):
    if what == "the robot":
        data.qpos[0] += 2 * STILL
    elif what == "the robot turns":
        data.qpos[3:7] = [np.cos(1e-4), 0.0, 0.0, np.sin(1e-4)]
    elif what == "a person":
        data.mocap_pos[0, 1] -= 2 * STILL
    elif what == "a parcel turns":
        data.qpos[-7 + 3 :] = [np.cos(1e-4), 0.0, 0.0, np.sin(1e-4)]


@pytest.mark.parametrize("what", ["the robot", "the robot turns", "a person", "a parcel turns"])
def test_whatever_moves_is_measured_again_once(room, rest, what):
    model, data = room
    moves(data, what)
    mujoco.mj_forward(model, data)
    assert not rest.holds(data)
    assert rest.holds(data) != what.startswith("the robot"), "once more, as the robot came to rest"
    assert rest.holds(data)


def test_slow_motion_is_motion(room, rest):
    """Every step is below what counts; together they are not."""
    model, data = room
    held = []
    for _ in range(30):
        data.mocap_pos[0, 0] += STILL / 5
        mujoco.mj_forward(model, data)
        held.append(rest.holds(data))
    assert 4 <= held.count(False) <= 7


def test_trembling_and_the_own_arm_are_no_motion(room, rest):
    model, data = room
    for _ in range(10):
        data.qpos[0] += STILL / 1000
        data.qpos[model.joint("shoulder").qposadr[0]] += 0.1
        mujoco.mj_forward(model, data)
        assert rest.holds(data)
