"""The world: ticks, schedules, reset, real time."""

from __future__ import annotations

import threading
import time

import mujoco
import numpy as np
import pytest

from telepresence.sim.world import STEPS_PER_TICK, TICK, TIMESTEP, World

BALL = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <body name="ball" pos="0 0 .5"><freejoint/><geom type="sphere" size=".1"/></body>
  </worldbody>
</mujoco>
"""
HOLE = BALL.replace('<geom name="floor" type="plane" size="1 1 .1"/>', "")


def make(xml: str = BALL, seed: int = 0) -> World:
    return World(mujoco.MjSpec.from_string(xml), seed=seed)


def test_a_tick_is_two_steps_of_the_implicit_integrator():
    world = make()
    world.step(10)
    assert STEPS_PER_TICK * TIMESTEP == TICK
    assert world.model.opt.timestep == TIMESTEP
    assert world.model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert world.time == pytest.approx(10 * TICK)
    with world.locked() as data:
        assert data.time == pytest.approx(world.time)


def test_callbacks_keep_their_periods():
    world = make()
    calls: dict[float, list[float]] = {0.005: [], 0.1: [], 0.16: []}
    for period, times in calls.items():
        world.every(period, times.append)
    world.step(400)
    for period, times in calls.items():
        assert len(times) == pytest.approx(2.0 / period, abs=1)
        assert np.diff(times) == pytest.approx(period)


def test_it_is_locked_for_whoever_need_not_wait():
    world = make()
    found = []

    def look() -> None:
        with world.locked_if_free() as held:
            found.append(held)

    def look_elsewhere() -> None:
        thread = threading.Thread(target=look)
        thread.start()
        thread.join()

    look_elsewhere()
    with world.locked():
        look_elsewhere()
        look()
    look_elsewhere()
    assert found == [True, False, True, True]


def test_a_phase_delays_the_first_call():
    world = make()
    times: list[float] = []
    world.every(0.1, times.append, phase=0.05)
    world.step(60)
    assert times == pytest.approx([0.05, 0.15, 0.25])


def test_reset_restores_the_state_and_time_goes_on():
    world = make()
    world.on_reset(lambda: seen.append(world.time))
    seen: list[float] = []
    with world.locked() as data:
        start = data.qpos.copy()
    world.step(40)
    with world.locked() as data:
        assert data.qpos[2] < start[2]
    world.reset()
    with world.locked() as data:
        assert np.array_equal(data.qpos, start)
    assert seen == [pytest.approx(40 * TICK)]
    world.step(40)
    assert world.time == pytest.approx(80 * TICK)
    assert len(seen) == 1
    with world.locked() as data:
        assert data.qpos[2] < start[2]


def test_equal_seeds_give_equal_runs():
    first, second, other = make(seed=3), make(seed=3), make(seed=4)
    assert first.rng("laser").standard_normal(4).tolist() == second.rng("laser").standard_normal(4).tolist()
    assert first.rng("laser").standard_normal() != other.rng("laser").standard_normal()
    assert first.rng("laser").standard_normal() != first.rng("sonar").standard_normal()
    for world in (first, second):
        world.step(100)
    with first.locked() as a, second.locked() as b:
        assert np.array_equal(a.qpos, b.qpos)


def test_unstable_physics_resets_the_world(caplog):
    world = make()
    resets: list[bool] = []
    world.on_reset(lambda: resets.append(True))
    world.step(10)
    with world.locked() as data:
        data.qvel[0] = np.nan
    world.step(1)
    with world.locked() as data:
        assert np.isfinite(data.qpos).all()
    assert resets and "unstable" in caplog.text
    assert world.time == pytest.approx(11 * TICK)


def test_something_that_falls_out_of_the_world_resets_it(caplog):
    world = make(HOLE)
    world.step(600)
    assert "fell out of the world" in caplog.text
    with world.locked() as data:
        assert data.qpos[2] > -5.0


def test_posted_work_runs_outside_the_lock():
    world = make()
    free: list[bool] = []

    def others_get_the_lock() -> None:
        entered = threading.Event()

        def enter() -> None:
            with world.locked():
                entered.set()

        threading.Thread(target=enter).start()
        free.append(entered.wait(5.0))

    world.every(TICK, lambda now: world.post(others_get_the_lock) if not free else None)
    world.step(1)
    assert free == [True]


def test_a_failing_posted_callback_does_not_stop_the_others(caplog):
    world = make()
    ran: list[int] = []
    world.post(lambda: 1 / 0)
    world.post(lambda: ran.append(1))
    world.step(1)
    assert ran == [1] and "ZeroDivisionError" in caplog.text


def test_step_is_for_a_world_that_does_not_run():
    with make() as world, pytest.raises(RuntimeError, match="real time"):
        world.step(1)


def test_a_closed_world_does_not_start_again():
    world = make()
    told: list[bool] = []
    world.on_close(lambda: told.append(True))
    world.start()
    world.close()
    world.close()
    assert told == [True] and not world.running
    with pytest.raises(RuntimeError, match="closed"):
        world.start()


def test_running_keeps_pace_with_the_clock(wait_until):
    with make() as world:
        begun, start = time.monotonic(), world.time
        wait_until(lambda: world.time - start > 0.6, "the world runs")
        elapsed = time.monotonic() - begun
        simulated = world.time - start + world.dropped_time
        # Never ahead of the clock; behind by no more than a stall that is still being caught up.
        assert simulated <= elapsed + 0.05
        assert simulated >= elapsed - 0.5


def test_a_stall_is_dropped_and_counted(wait_until):
    with make() as world:
        wait_until(lambda: world.time > 0.05, "the world runs")
        before = world.time
        with world.locked():
            time.sleep(0.6)
        wait_until(lambda: world.time > before + 0.05, "the world goes on")
        assert world.dropped_time > 0.25


def test_an_exception_in_a_callback_stops_the_clock_and_is_logged(caplog, wait_until):
    world = make()
    world.every(TICK, lambda now: 1 / 0)
    world.start()
    wait_until(lambda: not world.running, "the thread ends")
    assert "stopped stepping" in caplog.text
    world.close()
    with pytest.raises(ZeroDivisionError):
        broken = make()
        broken.every(TICK, lambda now: 1 / 0)
        broken.step(1)
