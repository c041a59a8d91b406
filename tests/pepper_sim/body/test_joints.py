"""Joints: slewing, trajectories, stiffness."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pepper_sim.body.description import JOINTS, LIMITS
from pepper_sim.body.joints import monotone_cubic
from pepper_sim.body.postures import CROUCH, STAND, STAND_ZERO
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.scene import build_world

ARMS_AND_HEAD = [joint for joint in JOINTS if joint not in ("HipRoll", "HipPitch", "KneePitch")]


@pytest.fixture(name="pepper")
def _pepper():
    return Pepper(build_world("empty", [pepper_model()]), None)


@pytest.mark.parametrize("posture", [STAND, STAND_ZERO, CROUCH], ids=["Stand", "StandZero", "Crouch"])
def test_takes_and_holds_every_posture(pepper, posture):
    done = pepper.follow({joint: [(2.0, angle)] for joint, angle in posture.items()})
    pepper.world.step(520)
    assert done.result(0) is True
    now = pepper.snapshot()
    assert now.joint_positions == pytest.approx(dict(posture), abs=0.004)
    assert not now.fallen
    assert pepper.truth()[3:5] == pytest.approx((0.0, 0.0), abs=0.01)


def test_slews_at_the_given_speed_and_stops_there(pepper):
    pepper.set_angles({"HeadYaw": 1.0, "LElbowYaw": 0.0}, {"HeadYaw": 0.5, "LElbowYaw": 2.0})
    pepper.world.step(200)
    now = pepper.snapshot()
    assert now.joint_velocities["HeadYaw"] == pytest.approx(0.5, abs=0.02)
    assert now.joint_positions["HeadYaw"] == pytest.approx(0.5 - 0.0077, abs=0.02)
    assert now.joint_positions["LElbowYaw"] == pytest.approx(0.0, abs=0.005)
    pepper.world.step(300)
    assert pepper.snapshot().joint_positions["HeadYaw"] == pytest.approx(1.0, abs=0.004)


def test_top_speed_does_not_overshoot_much(pepper):
    pepper.set_angles({"LShoulderPitch": 0.0, "HeadYaw": 1.2}, {})
    seen = []
    for _ in range(200):
        pepper.world.step(1)
        seen.append(pepper.snapshot().joint_positions)
    assert min(s["LShoulderPitch"] for s in seen) > -0.12
    assert max(s["HeadYaw"] for s in seen) < 1.32


def test_angles_and_speeds_are_clipped_to_the_limits(pepper):
    pepper.set_angles({"HeadPitch": 9.0, "LHand": 1.0}, {"HeadPitch": 99.0})
    pepper.world.step(300)
    now = pepper.snapshot()
    assert now.joint_setpoints["HeadPitch"] == LIMITS["HeadPitch"].upper
    assert now.joint_setpoints["LHand"] == LIMITS["LHand"].upper


def test_follows_knots_smoothly_and_closely(pepper):
    knots = {"HeadYaw": [(0.5, 0.5), (1.0, -0.5), (1.5, 0.0)], "RShoulderPitch": [(1.2, 0.4)]}
    done = pepper.follow(knots)
    seen = []
    for _ in range(320):
        pepper.world.step(1)
        now = pepper.snapshot()
        seen.append((now.time, now.joint_positions["HeadYaw"], now.joint_setpoints["HeadYaw"]))
    assert done.result(0) is True
    times, measured, wanted = (np.array(column) for column in zip(*seen, strict=True))
    for moment, angle in knots["HeadYaw"]:
        assert measured[np.abs(times - moment).argmin()] == pytest.approx(angle, abs=0.03)
    assert np.abs(measured - wanted).max() < 0.03
    assert max(abs(measured)) < 0.53, "no overshoot between knots"
    assert pepper.snapshot().joint_positions["RShoulderPitch"] == pytest.approx(0.4, abs=0.01)


def test_a_trajectory_faster_than_the_motor_takes_longer(pepper):
    done = pepper.follow({"HipPitch": [(0.05, -0.9)]})
    pepper.world.step(20)
    assert not done.done()
    pepper.world.step(200)
    assert done.result(0) is True


def test_another_command_for_a_joint_interrupts_its_trajectory(pepper):
    first = pepper.follow({"HeadYaw": [(2.0, 1.0)], "HeadPitch": [(2.0, 0.3)]})
    other = pepper.follow({"LHand": [(1.0, 0.1)]})
    pepper.world.step(100)
    pepper.set_angles({"HeadYaw": 0.0}, {})
    pepper.world.step(200)
    assert first.result(0) is False
    assert other.result(0) is True
    assert pepper.snapshot().joint_positions["HeadYaw"] == pytest.approx(0.0, abs=0.01)
    assert pepper.snapshot().joint_positions["HeadPitch"] < 0.1, "the rest of the trajectory ended too"


def test_a_cancelled_trajectory_stops_where_it_is(pepper):
    done = pepper.follow({"HeadYaw": [(2.0, 1.5)]})
    pepper.world.step(200)
    assert done.cancel()
    pepper.world.step(1)
    here = pepper.snapshot().joint_setpoints["HeadYaw"]
    pepper.world.step(300)
    assert pepper.snapshot().joint_positions["HeadYaw"] == pytest.approx(here, abs=0.02)
    assert 0.3 < here < 1.2


def test_stop_joints_holds_them(pepper):
    done = pepper.follow({"HeadYaw": [(2.0, 1.5)]})
    pepper.set_angles({"LHand": 0.02}, {"LHand": 0.1})
    pepper.world.step(200)
    pepper.stop_joints()
    pepper.world.step(100)
    assert done.result(0) is False
    assert 0.3 < pepper.snapshot().joint_positions["HeadYaw"] < 1.2
    assert pepper.snapshot().joint_positions["LHand"] == pytest.approx(0.49, abs=0.02)


def test_limp_arms_fall_and_legs_are_held_by_brakes(pepper):
    pepper.set_angles(STAND_ZERO, {})
    pepper.world.step(400)
    assert pepper.snapshot().joint_positions["LShoulderPitch"] == pytest.approx(0.0245, abs=0.005)
    pepper.set_stiffness(dict.fromkeys(JOINTS, 0.0))
    pepper.world.step(600)
    now = pepper.snapshot()
    assert now.joint_positions["LShoulderPitch"] > 1.3
    assert now.joint_positions["RShoulderPitch"] > 1.3
    assert now.joint_setpoints["LShoulderPitch"] == pytest.approx(now.joint_positions["LShoulderPitch"], abs=0.01)
    for joint in ("HipPitch", "KneePitch", "HipRoll"):
        assert now.joint_positions[joint] == pytest.approx(STAND_ZERO[joint], abs=0.03)
    assert abs(now.joint_torques["LShoulderPitch"]) < 1e-6


def test_stiffening_does_not_jump(pepper):
    pepper.set_stiffness(dict.fromkeys(ARMS_AND_HEAD, 0.0))
    pepper.world.step(400)
    before = pepper.snapshot().joint_positions
    pepper.set_stiffness(dict.fromkeys(ARMS_AND_HEAD, 1.0))
    pepper.world.step(200)
    after = pepper.snapshot().joint_positions
    assert after == pytest.approx(before, abs=0.05)


def test_an_arm_held_out_needs_torque(pepper):
    pepper.set_angles(STAND_ZERO, {})
    pepper.world.step(500)
    assert -4.0 < pepper.snapshot().joint_torques["LShoulderPitch"] < -1.0


def test_what_makes_no_sense_is_refused(pepper):
    with pytest.raises(ValueError, match=r"'Tail'.*HeadYaw"):
        pepper.set_angles({"Tail": 0.0}, {})
    with pytest.raises(ValueError, match="finite"):
        pepper.set_angles({"HeadYaw": math.nan}, {})
    with pytest.raises(ValueError, match="no knots"):
        pepper.follow({"HeadYaw": []})
    with pytest.raises(ValueError, match="increasing"):
        pepper.follow({"HeadYaw": [(1.0, 0.0), (1.0, 0.1)]})
    with pytest.raises(ValueError, match="increasing"):
        pepper.follow({"HeadYaw": [(0.0, 0.0)]})
    with pytest.raises(ValueError, match="at most"):
        pepper.follow({"HeadYaw": [(1e9, 0.0)]})
    with pytest.raises(ValueError, match="stiffness"):
        pepper.set_stiffness({"HeadYaw": math.inf})


def test_the_curve_passes_its_knots_and_never_overshoots():
    x, y = np.array([0.0, 1.0, 1.5, 3.0]), np.array([0.0, 2.0, 2.0, -1.0])
    at = np.linspace(0.0, 3.5, 701)
    curve = monotone_cubic(x, y, at)
    assert monotone_cubic(x, y, x) == pytest.approx(y)
    assert curve.max() <= 2.0 and curve.min() >= -1.0
    assert curve[-1] == -1.0
    assert np.abs(np.diff(curve)).max() / 0.005 < 5.0
