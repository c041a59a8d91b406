"""Ways to drive, compared: by the clock or by odometry, with the safety gate or without; for the walker two gaits.

`./stack bench control` runs everything. `python tests/bench/bench_control.py --out FOLDER [NAME ...]` runs some robots,
keeps their trials in FOLDER/control.json, and draws what is there.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from control.figures import Cell, WalkCell, cells, table, walk_cells, walk_table
from control.plot import draw_figures, draw_paths
from control.run import Job, Trial, in_parallel, jobs, run_job
from control.vehicles import VEHICLES
from control.walk import Walk, WalkJob, run_walk, walk_jobs
from report import Row

SEEDS = range(1, 6)
"""Seeds of the tasks."""
WALK_SEEDS = range(20)
WALKS = "walks"
"""The name of the walker's 20 starts among those of the robots."""
ENOUGH = {"flat": 1.0, "rough": 0.9}
"""Share of walks that must succeed."""


def run(out: Path | None = None) -> list[Row]:
    """Run everything; about five minutes on two free cores.

    Args:
        out: Folder for control.json, control.png and control_square.png.
    """
    trials = [trial for name in VEHICLES for trial in _tasks(name)]
    walks = _walks()
    if out is not None:
        save(out, trials, walks)
    return rows(cells(trials), walk_cells(walks))


def rows(found: Sequence[Cell], walked: Sequence[WalkCell]) -> list[Row]:
    """The comparisons that matter, as every benchmark reports them."""
    at = {(c.vehicle, c.task, c.strategy): c for c in found}
    made = []
    for vehicle, kind in VEHICLES.items():
        clock, feedback = at[vehicle, "square", "open loop"], at[vehicle, "square", "odometry"]
        made.append(Row(f"{kind.label}: error after a square", feedback.error, clock.error, "m", "open loop"))
    for vehicle in ("pepper", "robotino"):
        bare, guarded = at[vehicle, "wall", "odometry"], at[vehicle, "wall", "odometry, gate"]
        label = VEHICLES[vehicle].label
        made.append(Row(f"{label}: stops before the wall", _safe(guarded), max(_safe(bare), 1), "", "no gate"))
    trot, crawl = at["trot", "straight", "odometry"], at["crawl", "straight", "odometry"]
    made.append(Row("walker: work for 2 m, trot", trot.work, crawl.work, "J", "crawl"))
    for cell in walked:
        way = "forward" if cell.direction > 0 else "backward"
        name = f"{cell.vehicle} 1 m {way}, {cell.scene}: walks without a fall"
        made.append(Row(name, cell.successes, ENOUGH[cell.scene] * cell.walks, "", "wanted"))
    return made


def save(out: Path, trials: Sequence[Trial], walks: Sequence[Walk]) -> None:
    """Write figures, and pictures of them, into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    found, walked = cells(trials), walk_cells(walks)
    record = {
        "seeds": list(SEEDS),
        "walk_seeds": list(WALK_SEEDS),
        "cells": [asdict(cell) for cell in found],
        "walks": [asdict(cell) for cell in walked],
        "trials": [asdict(trial) for trial in trials],
        "walk_trials": [asdict(walk) for walk in walks],
    }
    (out / "control.json").write_text(json.dumps(record))
    if found:
        draw_figures(out / "control.png", found)
    if squares := [trial for trial in trials if trial.job.task == "square"]:
        draw_paths(out / "control_square.png", squares)
    print(f"  written to {out}/control.json, control.png, control_square.png", flush=True)


def load(out: Path) -> tuple[list[Trial], list[Walk]]:
    """What `save` has written into a folder; nothing if it was not."""
    file = out / "control.json"
    if not file.exists():
        return [], []
    record = json.loads(file.read_text())
    trials = [Trial(**{**t, "job": Job(**t["job"])}) for t in record["trials"]]
    return trials, [Walk(**{**w, "job": WalkJob(**w["job"])}) for w in record["walk_trials"]]


def _tasks(vehicle: str, seeds: Sequence[int] = SEEDS) -> list[Trial]:
    trials = list(in_parallel(run_job, jobs(vehicle, seeds)))
    print(table(cells(trials)), flush=True)
    return trials


def _walks(seeds: Sequence[int] = WALK_SEEDS) -> list[Walk]:
    walks = list(in_parallel(run_walk, walk_jobs(seeds)))
    print(walk_table(walk_cells(walks)), flush=True)
    return walks


def main() -> int:
    """Some robots at a time."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"any of {', '.join((*VEHICLES, WALKS))}; default all")
    parser.add_argument("--out", type=Path, required=True, help="folder for figures and pictures")
    options = parser.parse_args()
    names = options.names or [*VEHICLES, WALKS]
    if unknown := set(names) - {*VEHICLES, WALKS}:
        parser.error(f"there is no {min(unknown)}; there are {', '.join((*VEHICLES, WALKS))}")
    trials, walks = load(options.out)
    for name in names:
        if name == WALKS:
            walks = _walks()
        else:
            trials = [t for t in trials if t.job.vehicle != name] + _tasks(name)
        save(options.out, trials, walks)
    return 0


def _safe(cell: Cell) -> int:
    return cell.trials - cell.touched


if __name__ == "__main__":
    sys.exit(main())
