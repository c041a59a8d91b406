"""Battery and temperatures: slow, and in the right direction."""

from __future__ import annotations

import numpy as np
import pytest

from pepper_sim.body.description import BATTERY_ENERGY, JOINTS
from pepper_sim.body.postures import STAND_ZERO
from pepper_sim.body.power import ELECTRONICS_RISE, FULL_CHARGE, ROOM, TORQUE_RISE, Power
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world

IDLE = np.zeros(len(JOINTS))
STIFF = np.ones(len(JOINTS))


def test_stands_about_half_a_day_on_one_charge():
    power = Power()
    hours = 0.0
    while power.battery.charge > 0.0 and hours < 48.0:
        power.update(60.0, IDLE, STIFF, 0.0)
        hours += 60.0 / 3600.0
    assert 9.0 < hours < 14.0
    assert power.battery.charge == 0.0


def test_use_costs_charge():
    idle, stiff, driving = Power(), Power(), Power()
    for power, stiffness, speed in ((idle, IDLE, 0.0), (stiff, STIFF, 0.0), (driving, STIFF, 0.35)):
        power.update(600.0, IDLE, stiffness, speed)
    assert FULL_CHARGE > idle.battery.charge > stiff.battery.charge > driving.battery.charge
    assert driving.battery.current < stiff.battery.current < 0.0


def test_the_current_fits_the_charge():
    power = Power()
    for _ in range(3600):
        power.update(1.0, IDLE, STIFF, 0.0)
    energy = (FULL_CHARGE - power.battery.charge) * BATTERY_ENERGY
    assert energy == pytest.approx(-power.battery.current * 26.46 * 3600.0, rel=0.01)


def test_a_loaded_motor_gets_warm_and_cools_again():
    power = Power()
    torque = IDLE.copy()
    torque[JOINTS.index("LShoulderPitch")] = 4.35
    for _ in range(3600):
        power.update(1.0, torque, STIFF, 0.0)
    warm = power.temperatures[JOINTS.index("LShoulderPitch")]
    assert warm == pytest.approx(ROOM + ELECTRONICS_RISE + TORQUE_RISE, abs=1.0)
    assert power.temperatures[JOINTS.index("HeadYaw")] == pytest.approx(ROOM + ELECTRONICS_RISE)
    for _ in range(3600):
        power.update(1.0, IDLE, STIFF, 0.0)
    assert power.temperatures[JOINTS.index("LShoulderPitch")] < ROOM + ELECTRONICS_RISE + 1.0


def test_arms_held_out_get_warmer_than_arms_that_hang():
    pepper = Pepper(build_world("empty", [pepper_model()]), None)
    pepper.set_angles(STAND_ZERO, {})
    pepper.world.step(200 * 30)
    warm = pepper.snapshot().temperatures
    assert warm["LShoulderPitch"] > ROOM + ELECTRONICS_RISE + 0.2
    assert warm["LShoulderPitch"] > warm["HeadYaw"]
    assert pepper.snapshot().battery.charge < FULL_CHARGE


def test_smart_stiffness_saves_power_while_nothing_moves():
    currents = {}
    for smart in (True, False):
        pepper = Pepper(build_world("empty", [pepper_model()]), None)
        pepper.smart_stiffness = smart
        pepper.world.step(410)
        assert set(pepper.snapshot().stiffness.values()) == {1.0}, "what was set is what is read"
        currents[smart] = pepper.snapshot().battery.current
    assert currents[False] < currents[True] - 0.1 < 0.0
