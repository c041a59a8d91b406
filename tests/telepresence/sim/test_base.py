"""The planar base: limits, ramps, odometry. A bare cart drives in the scene for tests."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from telepresence.geometry import wrap_angle
from telepresence.sim.base import BaseLimits, Braking, PlanarBase
from telepresence.sim.scene import RobotModel, build_world
from telepresence.sim.world import TICK

CART = """
<mujoco model="cart">
  <worldbody>
    <body name="base_footprint">
      <freejoint name="root"/>
      <geom type="cylinder" pos="0 0 .1" size=".2 .07" mass="20"/>
      <geom type="sphere" pos=".15 0 .03" size=".03" condim="1" priority="2" contype="4" conaffinity="0" mass="0"/>
      <geom type="sphere" pos="-.1 .12 .03" size=".03" condim="1" priority="2" contype="4" conaffinity="0" mass="0"/>
      <geom type="sphere" pos="-.1 -.12 .03" size=".03" condim="1" priority="2" contype="4" conaffinity="0" mass="0"/>
      <site name="drive"/>
    </body>
  </worldbody>
  <actuator>
    <velocity name="drive_x" site="drive" gear="1 0 0 0 0 0" kv="8000" forcerange="-60 60"/>
    <velocity name="drive_y" site="drive" gear="0 1 0 0 0 0" kv="8000" forcerange="-60 60"/>
    <velocity name="drive_yaw" site="drive" gear="0 0 0 0 0 1" kv="200" forcerange="-10 10"/>
  </actuator>
</mujoco>
"""
LIMITS = BaseLimits(max_xy=0.5, max_theta=1.5, acc_xy=0.5, acc_theta=1.0)
BRAKING = Braking(xy=1.0, theta=2.0)


class Cart:
    """Drives a `PlanarBase` with a constant command."""

    def __init__(self, seed: int = 0) -> None:
        model = RobotModel(lambda: mujoco.MjSpec.from_string(CART), "cart/", "spawn_robotino")
        self.world = build_world("empty", [model], seed)
        self.base = PlanarBase(self.world.model, "cart/", LIMITS, BRAKING, self.world.rng("cart"))
        self.command = (0.0, 0.0, 0.0)
        self.on_course = False
        self.speeds: list[float] = []
        self.world.every(TICK, self._tick)

    def _tick(self, now: float) -> None:
        with self.world.locked() as data:
            self.base.drive(*self.command, TICK, on_course=self.on_course)
            self.base.write(data)
            self.speeds.append(math.hypot(self.base.vx, self.base.vy))

    def truth(self) -> tuple[float, float, float]:
        with self.world.locked() as data:
            x, y, _, w, _, _, z = data.qpos[:7]
        return x, y, 2.0 * math.atan2(z, w)


@pytest.mark.parametrize("command", [(0.2, 0.0, 0.0), (0.0, -0.2, 0.0), (0.0, 0.0, 0.8), (0.15, 0.1, 0.5)])
def test_reaches_the_commanded_velocity(command):
    cart = Cart()
    cart.command = command
    cart.world.step(400)
    with cart.world.locked() as data:
        heading = cart.truth()[2]
        c, s = math.cos(heading), math.sin(heading)
        vx, vy = data.qvel[0] * c + data.qvel[1] * s, data.qvel[1] * c - data.qvel[0] * s
        measured = (vx, vy, data.qvel[5])
    assert measured == pytest.approx(command, abs=0.05 * 0.2)


def test_speeds_up_and_slows_down_within_the_limits():
    cart = Cart()
    cart.command = (0.4, 0.3, 0.0)
    cart.world.step(300)
    cart.command = (0.0, 0.0, 0.0)
    cart.world.step(300)
    changes = np.diff(cart.speeds) / TICK
    assert changes.max() == pytest.approx(LIMITS.acc_xy)
    assert changes.min() == pytest.approx(-BRAKING.xy)
    assert cart.base.standing


def test_clamps_the_size_and_keeps_the_direction():
    base = Cart().base
    assert base.clamp(3.0, 4.0, -9.0) == pytest.approx((0.3, 0.4, -1.5))
    assert base.clamp(0.1, -0.1, 0.3) == (0.1, -0.1, 0.3)


def test_odometry_follows_truth_on_free_floor():
    cart = Cart()
    cart.command = (0.2, 0.1, 0.4)
    cart.world.step(800)
    cart.command = (0.0, 0.0, 0.0)
    cart.world.step(200)
    x, y, theta = cart.base.odometry
    truth = cart.truth()
    assert (x, y - 1.5) == pytest.approx(truth[:2], abs=0.02)
    assert wrap_angle(theta - truth[2]) == pytest.approx(0.0, abs=0.03)


def test_odometry_is_not_truth_and_its_error_is_seeded():
    poses = []
    for seed in (1, 1, 2):
        cart = Cart(seed)
        cart.command = (0.3, 0.0, 0.0)
        cart.world.step(600)
        poses.append((cart.base.x, cart.truth()[0]))
    assert poses[0] == poses[1]
    assert poses[0][0] != poses[2][0]
    assert poses[0][0] != pytest.approx(poses[0][1], abs=1e-5)


def test_odometry_goes_on_while_a_wall_stops_the_base():
    cart = Cart()
    cart.command = (0.5, 0.0, 0.0)
    cart.world.step(3000)
    assert cart.truth()[0] == pytest.approx(3.8, abs=0.01)
    assert cart.base.x > 6.0


def test_a_straight_course_stays_straight_while_turning():
    cart = Cart()
    cart.on_course = True
    deviation = 0.0
    for _ in range(600):
        heading = cart.base.theta
        cart.command = (0.3 * math.cos(heading), -0.3 * math.sin(heading), 1.0)
        cart.world.step(1)
        deviation = max(deviation, abs(cart.base.y))
    assert deviation < 0.01
    assert cart.base.x > 0.7


def test_a_standing_base_holds_its_place_on_a_slope():
    cart = Cart()
    slope = math.radians(10.0)
    cart.world.model.opt.gravity[:] = (-9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope))
    cart.world.step(1000)
    assert cart.truth()[0] == pytest.approx(0.0, abs=0.003)
    cart.command = (0.2, 0.0, 0.0)
    cart.world.step(400)
    cart.command = (0.0, 0.0, 0.0)
    cart.world.step(100)
    stopped = cart.truth()[0]
    assert stopped == pytest.approx(cart.base.x, abs=0.03)
    cart.world.step(1000)
    assert cart.truth()[0] == pytest.approx(stopped, abs=0.003)


def test_a_shove_is_answered_without_chatter():
    cart = Cart()
    cart.world.step(20)
    with cart.world.locked() as data:
        data.qvel[:2] += 0.4
        data.qvel[5] += 1.0
    cart.world.step(200)
    rates = []
    for _ in range(40):
        cart.world.step(1)
        with cart.world.locked() as data:
            rates.append(data.qvel[[0, 1, 5]].copy())
    assert np.ptp(rates, axis=0).max() < 0.002


def test_the_order_of_the_actuators_is_checked():
    swapped = CART.replace("drive_y", "tmp").replace("drive_x", "drive_y").replace("tmp", "drive_x")
    model = mujoco.MjSpec.from_string(swapped).compile()
    with pytest.raises(ValueError, match="drive_x, drive_y, drive_yaw"):
        PlanarBase(model, "", LIMITS, BRAKING, np.random.default_rng(0))
