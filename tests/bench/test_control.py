"""The control benchmark's pilots, trials and pictures, on few and short trials."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path

import bench_control
import cv2
import pytest
from control import page as page_tool
from control.figures import cells, table
from control.pilots import GIVE_UP, PAUSE, PERIOD, ByOdometry, ByTheClock, Leg, Pilot
from control.run import Job, run_job
from control.tasks import TASKS
from control.walk import WalkJob, run_walk

pytestmark = pytest.mark.slow

SQUARE = TASKS["square"].path


def drive(pilot: Pilot, drift: float = 0.0, speed: float = 1.0) -> tuple[float, float, float, float]:
    """A point that moves as commanded, but for turning by `drift` [rad/s]: its end x, y, heading, and when."""
    x = y = heading = now = 0.0
    while (velocity := pilot.decide(now, (x, y, heading))) is not None:
        vx, _, wz = velocity
        heading += (wz + (drift if vx else 0.0)) * PERIOD
        x, y = x + speed * vx * math.cos(heading) * PERIOD, y + speed * vx * math.sin(heading) * PERIOD
        now += PERIOD
        assert now < 200.0
    return x, y, heading, now


def test_by_the_clock_a_square_takes_its_time_and_ends_at_the_start_if_nothing_drifts():
    x, y, heading, now = drive(ByTheClock(SQUARE, 0.25, 0.5 * math.pi / 3.0))
    assert math.hypot(x, y) < 0.03 and math.remainder(heading, math.tau) == pytest.approx(0.0, abs=0.01)
    assert now == pytest.approx(4 * (4.0 + 3.0) + 8 * PAUSE, abs=0.2)


def test_odometry_closes_the_square_that_drift_opens():
    assert math.hypot(*drive(ByTheClock(SQUARE, 0.25, 0.5), drift=0.05)[:2]) > 0.3
    assert math.hypot(*drive(ByOdometry(SQUARE, 0.25, 0.5), drift=0.05)[:2]) < 0.05


def test_a_pilot_who_gets_nowhere_gives_up():
    *_, now = drive(ByOdometry((Leg(distance=1.0),), 0.25, 0.5), speed=0.0)
    assert now == pytest.approx(GIVE_UP + PAUSE, abs=0.2)


def test_a_job_gives_the_same_trial_each_time_and_another_seed_another():
    first, again = (run_job(Job("robotino", "straight", "open loop", 1)) for _ in range(2))
    other = run_job(Job("robotino", "straight", "open loop", 2))
    assert first == again and first.error != other.error
    assert first.success and first.error < 0.05 and first.work > 0.0 and not first.contacts


def test_the_gate_keeps_robotino_off_a_wall_that_odometry_drives_into():
    bare = run_job(Job("robotino", "wall", "odometry", NEARER))
    guarded = run_job(Job("robotino", "wall", "odometry, gate", NEARER))
    assert bare.contacts and not bare.success and bare.impact > 0.0
    assert not guarded.contacts and guarded.success


def test_results_come_back_from_the_folder_and_are_drawn(tmp_path: Path):
    straight = run_job(Job("trot", "wall", "odometry", 1))
    trials = [straight, replace(straight, job=replace(straight.job, task="square"))]
    walks = [run_walk(WalkJob("trot", "rough", 1, 3))]
    assert walks[0].success and walks[0].drift < 0.003
    bench_control.save(tmp_path, trials, walks)
    loaded = bench_control.load(tmp_path)
    assert [t.job for t in loaded[0]] == [t.job for t in trials] and loaded[1] == walks
    assert json.loads((tmp_path / "control.json").read_text())["cells"][0]["vehicle"] == "trot"
    assert "Walker, trot  square" in table(cells(loaded[0]))
    for name in ("control.png", "control_square.png"):
        picture = cv2.imread(str(tmp_path / name))
        assert picture.shape[0] > 200 and picture.std() > 5.0


def test_the_tables_of_the_page_are_those_of_the_record():
    page, record = page_tool.PAGE.read_text(), json.loads(page_tool.FIGURES.read_text())
    assert page_tool.filled(page, record) == page
    assert "| Walker, crawl | rough |" in page and f"of {len(record['walk_seeds'])} |" in page


def test_the_record_has_twenty_walks_of_each_kind_and_enough_of_them_without_a_fall():
    cells = json.loads(page_tool.FIGURES.read_text())["walks"]
    for wanted in itertools.product(("trot", "crawl"), ("flat", "rough"), (1, -1)):
        (cell,) = (c for c in cells if (c["vehicle"], c["scene"], c["direction"]) == wanted)
        assert cell["walks"] == 20 and cell["successes"] >= {"flat": 20, "rough": 18}[cell["scene"]], cell


NEARER = 3
"""A seed with which the wall is much nearer than believed."""
