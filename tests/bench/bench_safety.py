"""The safety gate against no gate, the guide's bubble and uniform scaling: who gets hit, who gets through."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path

from report import Row
from safety import mujoco_rooms, reaction
from safety.figures import Figures, figures, table
from safety.plot import draw_results, draw_scenario
from safety.robots import INFRARED_ROBOT, TICK
from safety.suite import GATES, REPORT_SEEDS, Cell, cells, run_all
from safety.trials import Trial, run_trials

TITLES = {
    "infrared": "Robotino, nine infrared beams",
    "measured": "Robotino, as measured over Wi-Fi",
    "laser": "Robotino with a laser",
    "pepper": "Pepper's own sensors",
}
COMPARED = {"infrared": 0.20, "measured": 0.20, "laser": 0.35, "pepper": 0.35}
"""Every gate is run at this speed; what is claimed of the gate holds up to it [m/s]."""
DRAWN = dict(seed=9001, index=15, speed=0.20, seconds=60.0)
"""The scenario of the picture."""


def run(out: Path | None = None, share: float = 1.0) -> list[Row]:
    """Run everything; about half an hour on two cores.

    Args:
        out: Folder for safety.json, safety.png and safety_scenario.png; None to write nothing.
        share: Of the scenarios; less than 1 also leaves out what runs in real time through the wire and the nodes.
    """
    outcomes = run_all(cells(share))
    found = {cell: figures(batches, TICK) for cell, batches in outcomes.items()}
    claims = {
        (robot, gate): figures(
            [o for cell, batches in outcomes.items() for o in batches
             if (cell.robot, cell.gate, cell.fault) == (robot, gate, "") and cell.speed <= COMPARED[robot]], TICK,
        )
        for robot, gate in dict.fromkeys((cell.robot, cell.gate) for cell in outcomes)
        if gate in ("gate", "gate, careful")
    }  # fmt: skip
    trials = run_trials(share)
    print(_report(found, trials), flush=True)
    rows, stack = _rows(found, claims, trials), []
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        draw_results(out / "safety.png", {title: _compared(found, robot) for robot, title in TITLES.items()})
        shown = {name: GATES[name] for name in ("no gate", "bubble, gap 0.10", "gate", "gate, careful")}
        draw_scenario(out / "safety_scenario.png", INFRARED_ROBOT, shown, **DRAWN)
    if share >= 1.0:
        print("  reaction times of the whole stack, about four minutes", flush=True)
        stack += reaction.run_rows()
        print("  rooms in MuJoCo through wire and nodes, about three minutes", flush=True)
        stack += mujoco_rooms.run_rows()
    if out is not None:
        record = {
            "seeds": REPORT_SEEDS,
            "cells": [{**asdict(cell), **asdict(f)} for cell, f in found.items()],
            "trials": [asdict(trial) for trial in trials],
            "stack": [row.as_dict() for row in stack],
        }
        (out / "safety.json").write_text(json.dumps(_without_nan(record), indent=1) + "\n")
        print(f"  written: safety.json, safety.png, safety_scenario.png in {out}\n", flush=True)
    return rows + stack


def _without_nan(value: object) -> object:
    """JSON knows no NaN; null says as much."""
    if isinstance(value, dict):
        return {key: _without_nan(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(part) for part in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _compared(found: dict[Cell, Figures], robot: str) -> dict[str, Figures]:
    return {
        cell.gate: f for cell, f in found.items()
        if cell.robot == robot and cell.speed == COMPARED[robot] and not cell.fault
    }  # fmt: skip


def _report(found: dict[Cell, Figures], trials: list[Trial]) -> str:
    parts = []
    for robot, title in TITLES.items():
        rows = [(f"{c.gate} {c.speed:.2f} m/s", f) for c, f in found.items() if c.robot == robot and not c.fault]
        parts += [f"{title}, {rows[0][1].commands / rows[0][1].scenarios:.0f} commands per scenario:", table(rows)]
    faults = [(c.fault, f) for c, f in found.items() if c.fault]
    parts += ["Faults (Robotino, infrared, gate):", table(faults)]
    slowest = ", ".join(f"{name} {f.stopped_after:.2f}" for name, f in faults if f.stopped_after == f.stopped_after)
    parts += [f"  longest time from the fault to the gate's first zero [s]: {slowest}", "Trials:"]
    width = max(len(trial.name) for trial in trials)
    parts += [
        f"  {t.robot:<10}{t.name:<{width}}  " + ", ".join(f"{key} {value:.4g}" for key, value in t.values.items())
        for t in trials
    ]
    return "\n".join(parts) + "\n"


def _rows(found: dict[Cell, Figures], claims: dict[tuple[str, str], Figures], trials: list[Trial]) -> list[Row]:
    rows = []
    for robot, title in TITLES.items():
        others = _compared(found, robot)
        for gate in ("gate", "gate, careful"):
            if (robot, gate) not in claims:
                continue
            ours, bubble = others[gate], others["bubble, gap 0.10"]
            name = f"{title}, {gate}"
            rows += [
                Row(f"{name}: collisions per 1000 commands", ours.per_1000.value, bubble.per_1000.value, "1/1000",
                    "bubble, gap 0.10 m"),
                Row(f"{name}: share passed", 100 * ours.passed, 100 * bubble.passed, "%", "bubble, gap 0.10 m"),
            ]  # fmt: skip
            every = claims[robot, gate]
            free = others["no gate"].per_1000.value
            rows.append(
                Row(f"{name}: upper 95 % bound, {every.commands} commands", every.per_1000.high, free, "1/1000",
                    "no gate")
            )  # fmt: skip
    rows += [
        Row(f"{TITLES[trial.robot]}: {trial.name}", trial.values[trial.judged], trial.wanted, trial.unit, "wanted")
        for trial in trials
    ]
    return rows
