"""The gait without a robot: which feet are up, where they go, what freezing does."""

from __future__ import annotations

import numpy as np
import pytest

from telepresence.sim.walker.gait import CRAWL, FARTHEST, GAITS, LANDING, STANCE, TROT, Gait, GaitController

LEVEL = (0.0, 0.0)
DT = 0.01
FORWARD = np.array([0.2, 0.0, 0.0])
each_gait = pytest.mark.parametrize("gait", GAITS.values(), ids=GAITS)


def walk(controller: GaitController, wanted: np.ndarray, seconds: float) -> np.ndarray:
    """Feet at every tick, shape (ticks, 4, 3)."""
    return np.array([controller.step(wanted, DT, LEVEL).copy() for _ in range(round(seconds / DT))])


def lifted(controller: GaitController, wanted: np.ndarray, seconds: float) -> np.ndarray:
    """Which feet are up at every tick, shape (ticks, 4)."""
    ups = []
    for _ in range(round(seconds / DT)):
        controller.step(wanted, DT, LEVEL)
        ups.append(controller.lifted.copy())
    return np.array(ups)


def test_trot_lifts_diagonal_feet_together_and_crawl_one_at_a_time():
    trot = lifted(GaitController(TROT), FORWARD, 3.0)
    assert (trot[:, 0] == trot[:, 3]).all() and (trot[:, 1] == trot[:, 2]).all()
    assert set(trot.sum(axis=1)) == {0, 2}
    crawl = lifted(GaitController(CRAWL), FORWARD, 6.0)
    assert crawl.sum(axis=1).max() == 1 and crawl.any(axis=0).all()


@each_gait
def test_feet_on_the_ground_carry_the_trunk_at_the_wanted_speed(gait: Gait):
    controller = GaitController(gait)
    wanted = np.array([0.5 * gait.top_speed[0], 0.0, 0.0])
    walk(controller, wanted, 3.0)
    for _ in range(200):
        before, down = controller.feet.copy(), ~controller.lifted
        controller.step(wanted, DT, LEVEL)
        down &= ~controller.lifted
        assert np.allclose((controller.feet - before)[down, 0] / DT, -wanted[0], atol=1e-6)


@each_gait
@pytest.mark.parametrize("wanted", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, -1.0, 9.0)])
def test_feet_stay_in_reach_whatever_is_asked(gait: Gait, wanted: tuple[float, float, float]):
    controller = GaitController(gait)
    feet = walk(controller, np.array(wanted), 4.0)
    assert np.abs(feet[..., :2] - STANCE[:, :2]).max() <= FARTHEST + gait.sway + 1e-9


@each_gait
def test_freezing_in_mid_step_puts_lifted_feet_down_where_they_are_and_then_holds(gait: Gait):
    controller = GaitController(gait)
    while not controller.lifted.any():
        controller.step(FORWARD, DT, LEVEL)
    for _ in range(5):
        before = controller.step(FORWARD, DT, LEVEL).copy()
    frozen = walk(controller, np.zeros(3), 1.0)
    assert np.allclose(frozen[:, :, :2], before[:, :2]), "a foot moved sideways after the freeze"
    settled = frozen[round(LANDING / DT) + 1 :]
    assert (settled == settled[0]).all() and np.allclose(settled[0, :, 2], STANCE[:, 2])
    assert not controller.walking


def test_a_new_start_begins_at_phase_zero_and_without_a_jump():
    controller = GaitController(TROT)
    walk(controller, FORWARD, 1.03)
    held = walk(controller, np.zeros(3), 1.0)[-1]
    first = controller.step(FORWARD, DT, LEVEL)
    assert controller.phase == pytest.approx(TROT.frequency * DT)
    assert np.abs(first - held).max() < 0.002


@each_gait
def test_stopping_and_starting_at_any_instant_moves_no_foot_by_a_jump(gait: Gait):
    controller = GaitController(gait)
    rng = np.random.default_rng(3)
    feet = [controller.step(np.zeros(3), DT, LEVEL).copy()]
    for _ in range(60):
        wanted = rng.choice([-1.0, 0.0, 1.0]) * FORWARD
        for _ in range(rng.integers(1, 30)):
            feet.append(controller.step(wanted, DT, LEVEL).copy())
    assert np.abs(np.diff(feet, axis=0)).max() < 0.02


def test_reset_puts_everything_under_the_hips():
    controller = GaitController(CRAWL)
    walk(controller, FORWARD, 1.3)
    controller.reset()
    assert controller.phase == 0.0 and not controller.walking
    assert np.allclose(controller.step(np.zeros(3), DT, LEVEL), STANCE)


def test_another_gait_is_taken_up_at_the_next_start():
    controller = GaitController(TROT)
    walk(controller, FORWARD, 0.5)
    controller.choose(CRAWL)
    walk(controller, FORWARD, 0.5)
    assert controller.gait is TROT
    walk(controller, np.zeros(3), 0.3)
    walk(controller, FORWARD, 0.1)
    assert controller.gait is CRAWL
