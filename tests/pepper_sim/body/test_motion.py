"""Driving: speeds, moves, stops, refusals."""

from __future__ import annotations

import math
import threading
from itertools import pairwise

import pytest

from pepper_sim.body.description import ABRUPT_BRAKING, BRAKING
from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from telepresence.sim.base import BaseLimits
from telepresence.sim.scene import build_world
from telepresence.sim.world import TICK


def make(seed: int = 0) -> Pepper:
    return Pepper(build_world("empty", [pepper_model()], seed=seed), None)


def until(pepper: Pepper, future, seconds: float = 60.0) -> float:
    """Step until `future` is done; the simulated seconds it took."""
    begun = pepper.world.time
    while not future.done():
        assert pepper.world.time - begun < seconds, f"not done after {seconds} simulated seconds"
        pepper.world.step(1)
    return pepper.world.time - begun


def test_two_tenths_are_two_tenths():
    pepper = make()
    pepper.set_velocity(0.2, 0.0, 0.0)
    pepper.world.step(200)
    before = pepper.truth()
    pepper.world.step(400)
    assert pepper.truth()[0] - before[0] == pytest.approx(0.4, rel=0.05)
    assert pepper.snapshot().velocity == pytest.approx((0.2, 0.0, 0.0))


def test_speed_and_acceleration_are_limited():
    pepper = make()
    pepper.set_velocity(2.0, 0.0, 5.0)
    speeds = []
    for _ in range(300):
        pepper.world.step(1)
        speeds.append(pepper.snapshot().velocity)
    assert max(v[0] for v in speeds) == pytest.approx(0.35)
    assert max(v[2] for v in speeds) == pytest.approx(1.0)
    steepest = max(b[0] - a[0] for a, b in pairwise(speeds)) / TICK
    assert steepest == pytest.approx(0.3)


def test_a_velocity_never_waits_for_the_world_and_counts_before_anything_else():
    pepper = make()
    at_once = threading.Event()

    def order():
        for speed in (0.1, 0.2):
            pepper.set_velocity(speed, 0.0, 0.0)
        at_once.set()

    with pepper.world.locked():
        threading.Thread(target=order, daemon=True).start()
        assert at_once.wait(30.0), "it waits for the world"
        assert not pepper.has_snapshot()
    assert pepper.snapshot().moving
    pepper.world.step(300)
    assert pepper.snapshot().velocity[0] == pytest.approx(0.2), "the newest counts"


def test_limits_can_be_changed_and_are_checked():
    pepper = make()
    pepper.base_limits = BaseLimits(0.55, 2.0, 0.55, 3.0)
    pepper.set_velocity(1.0, 0.0, 0.0)
    pepper.world.step(300)
    assert pepper.snapshot().velocity[0] == pytest.approx(0.55)
    with pytest.raises(ValueError, match="positive"):
        pepper.base_limits = BaseLimits(0.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    "goal",
    [(1.0, 0.0, 0.0), (0.0, -0.6, 0.0), (0.0, 0.0, math.pi / 2), (0.0, 0.0, -3.0), (1.5, -1.0, 1.0), (0.02, 0.0, 0.0)],
)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_move_ends_where_it_should(goal, seed):
    pepper = make(seed)
    future = pepper.move_to([goal])
    until(pepper, future)
    pepper.world.step(60)
    x, y, _, _, _, yaw = pepper.truth()
    assert future.result() is True
    assert math.hypot(x - goal[0], y - goal[1]) < 0.03
    assert abs(math.remainder(yaw - goal[2], math.tau)) < math.radians(3.0)
    assert not pepper.snapshot().moving and pepper.snapshot().velocity == (0.0, 0.0, 0.0)


def test_a_move_is_relative_to_the_robot():
    pepper = make()
    until(pepper, pepper.move_to([(0.5, 0.0, math.pi / 2)]))
    until(pepper, pepper.move_to([(0.5, 0.0, 0.0)]))
    assert pepper.truth()[:2] == pytest.approx((0.5, 0.5), abs=0.03)


def test_a_move_takes_the_time_of_its_profile():
    """1 m at 0.35 m/s and 0.3 m/s², of which planning uses nine tenths: 1 / 0.35 + 0.35 / 0.27 = 4.15 s."""
    pepper = make()
    assert until(pepper, pepper.move_to([(1.0, 0.0, 0.0)])) == pytest.approx(4.15, abs=0.25)


def test_a_move_can_be_given_more_time():
    pepper = make()
    assert until(pepper, pepper.move_to([(1.0, 0.0, 1.0)], duration=8.0)) == pytest.approx(8.0, abs=0.4)


def test_a_path_is_followed_through_its_waypoints():
    pepper = make()
    path = [(0.5, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.5, math.pi / 2), (1.0, 1.0, math.pi / 2)]
    future = pepper.move_to(path)
    nearest = [math.inf] * len(path)
    slowest_at_first = math.inf
    while not future.done():
        pepper.world.step(2)
        x, y = pepper.truth()[:2]
        nearest = [min(n, math.hypot(x - px, y - py)) for n, (px, py, _) in zip(nearest, path, strict=True)]
        if 0.4 < x < 0.6 and y < 0.1:
            slowest_at_first = min(slowest_at_first, pepper.snapshot().velocity[0])
        assert pepper.world.time < 30.0
    assert future.result() is True
    assert max(nearest) < 0.04
    assert slowest_at_first > 0.3, "a waypoint on a straight line is no reason to slow down"
    assert pepper.truth()[5] == pytest.approx(math.pi / 2, abs=math.radians(3.0))


def test_stop_is_done_when_the_wheels_stand():
    for abrupt, braking in ((False, BRAKING.xy), (True, ABRUPT_BRAKING.xy)):
        pepper = make()
        pepper.set_velocity(0.35, 0.0, 0.0)
        pepper.world.step(300)
        stop = pepper.stop_move(abrupt=abrupt)
        assert not stop.done()
        assert until(pepper, stop) == pytest.approx(0.35 / braking, abs=2 * TICK)
        assert stop.result() is True and not pepper.snapshot().moving


def test_stop_while_standing_is_done_at_once():
    pepper = make()
    assert until(pepper, pepper.stop_move()) <= TICK


@pytest.mark.parametrize(
    "drive", [lambda pepper: pepper.set_velocity(0.2, 0.0, 0.0), lambda pepper: pepper.move_to([(1.0, 0.0, 0.0)])]
)
def test_a_stop_is_over_when_another_command_drives_on(drive):
    pepper = make()
    pepper.set_velocity(0.35, 0.0, 0.0)
    pepper.world.step(300)
    stop = pepper.stop_move()
    drive(pepper)
    until(pepper, stop, seconds=0.1)
    assert stop.result() is False
    assert pepper.snapshot().velocity[0] > 0.1, "it has not stood"


def test_a_held_base_comes_to_a_stop_whatever_is_commanded():
    pepper = make()
    pepper.set_velocity(0.35, 0.0, 0.0)
    pepper.world.step(300)
    pepper.hold_base("stiffness", True)
    stop = pepper.stop_move()
    while not stop.done():
        pepper.set_velocity(0.35, 0.0, 0.0)
        pepper.world.step(1)
        assert pepper.world.time < 10.0
    assert stop.result() is True and not pepper.snapshot().moving and not pepper.can_drive
    assert pepper.snapshot().move_failed.cause == "stiffness"
    pepper.hold_base("charging", True)
    pepper.hold_base("stiffness", False)
    pepper.set_velocity(0.35, 0.0, 0.0)
    pepper.world.step(1)
    assert not pepper.snapshot().moving, "the other cause still holds"


@pytest.mark.parametrize("interrupt", ["set_velocity", "move_to", "stop_move"])
def test_a_new_command_interrupts_a_move(interrupt):
    pepper = make()
    move = pepper.move_to([(1.0, 0.0, 0.0)])
    pepper.world.step(100)
    {
        "set_velocity": lambda: pepper.set_velocity(0.0, 0.1, 0.0),
        "move_to": lambda: pepper.move_to([(0.1, 0.0, 0.0)]),
        "stop_move": pepper.stop_move,
    }[interrupt]()
    pepper.world.step(1)
    assert move.result(0) is False


def test_a_cancelled_move_stops():
    pepper = make()
    move = pepper.move_to([(1.0, 0.0, 0.0)])
    pepper.world.step(200)
    assert move.cancel()
    pepper.world.step(200)
    assert not pepper.snapshot().moving
    assert pepper.truth()[0] < 0.6


def test_values_that_are_no_numbers_are_refused_and_change_nothing():
    pepper = make()
    pepper.set_velocity(0.2, 0.0, 0.0)
    with pytest.raises(ValueError, match="finite"):
        pepper.set_velocity(math.nan, 0.0, 0.0)
    with pytest.raises(ValueError, match="finite"):
        pepper.move_to([(0.0, math.inf, 0.0)])
    with pytest.raises(ValueError, match="at least one"):
        pepper.move_to([])
    with pytest.raises(ValueError, match="duration"):
        pepper.move_to([(1.0, 0.0, 0.0)], duration=math.nan)
    pepper.world.step(200)
    assert pepper.snapshot().velocity[0] == pytest.approx(0.2)


def test_a_limp_leg_refuses_to_drive():
    pepper = make()
    pepper.set_velocity(0.2, 0.0, 0.0)
    pepper.world.step(100)
    pepper.set_stiffness({"KneePitch": 0.5})
    pepper.world.step(200)
    assert not pepper.snapshot().moving
    assert pepper.snapshot().move_failed.cause == "stiffness" and pepper.snapshot().move_failed.started
    move = pepper.move_to([(1.0, 0.0, 0.0)])
    pepper.world.step(1)
    assert move.result(0) is False
    assert pepper.snapshot().move_failed.count == 2 and not pepper.snapshot().move_failed.started


def test_a_velocity_sent_again_and_again_fails_once():
    pepper = make()
    pepper.set_stiffness({"HipPitch": 0.0})
    for _ in range(20):
        pepper.set_velocity(0.2, 0.0, 0.0)
        pepper.world.step(10)
    assert pepper.snapshot().move_failed.count == 1
    pepper.set_stiffness({"HipPitch": 1.0})
    for _ in range(20):
        pepper.set_velocity(0.35, 0.0, 0.0)
        pepper.world.step(10)
    assert pepper.truth()[0] > 0.1
    pepper.set_stiffness({"HipPitch": 0.0})
    pepper.set_velocity(0.35, 0.0, 0.0)
    assert pepper.snapshot().move_failed.count == 2


def test_wheels_turn_as_the_geometry_says():
    pepper = make()
    pepper.set_velocity(0.3, 0.0, 0.0)
    pepper.world.step(300)
    forward = pepper.snapshot().wheel_speeds
    assert forward["FL"] == pytest.approx(-forward["FR"]) and forward["FL"] == pytest.approx(0.8797 * 0.3 / 0.07)
    assert forward["B"] == pytest.approx(0.0)
    pepper.set_velocity(0.0, 0.0, -0.5)
    pepper.world.step(400)
    assert min(pepper.snapshot().wheel_speeds.values()) > 1.0, "clockwise turns all wheels forwards"


def test_next_odometry_looks_ahead():
    pepper = make()
    pepper.set_velocity(0.3, 0.0, 0.0)
    pepper.world.step(300)
    now = pepper.snapshot()
    assert now.next_odometry[0] - now.odometry[0] == pytest.approx(0.3 * 0.02)
