"""From trials to tables: means per robot, task and strategy."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from control.run import STRATEGIES, Trial
from control.tasks import TASKS
from control.vehicles import VEHICLES
from control.walk import Walk


@dataclass(frozen=True)
class Cell:
    """Trials of one robot, task and strategy; means over the seeds.

    `worst` is the largest error, `touched` counts trials with a contact, `impact` is the hardest of them [m/s].
    """

    vehicle: str
    task: str
    strategy: str
    trials: int
    successes: int
    time: float
    error: float
    worst: float
    work: float
    slip: float
    touched: int
    impact: float
    falls: int


def cells(trials: Sequence[Trial]) -> list[Cell]:
    """One for every robot, task and strategy that was tried, in their usual order."""
    groups: dict[tuple[str, str, str], list[Trial]] = {}
    for trial in trials:
        groups.setdefault((trial.job.vehicle, trial.job.task, trial.job.strategy), []).append(trial)
    order = [(v, t, s) for v in VEHICLES for t in TASKS for s in STRATEGIES]
    return [_cell(key, groups[key]) for key in order if key in groups]


def _cell(key: tuple[str, str, str], group: list[Trial]) -> Cell:
    def mean(name: str) -> float:
        return statistics.fmean(getattr(trial, name) for trial in group)

    return Cell(
        *key,
        trials=len(group),
        successes=sum(trial.success for trial in group),
        time=mean("time"),
        error=mean("error"),
        worst=max(trial.error for trial in group),
        work=mean("work"),
        slip=mean("slip"),
        touched=sum(trial.contacts > 0 for trial in group),
        impact=max(trial.impact for trial in group),
        falls=sum(trial.fell for trial in group),
    )


def table(found: Sequence[Cell]) -> str:
    """Return the figures as a table for people."""
    head = ("robot", "task", "strategy", "done", "time s", "error cm", "worst", "work J", "slip cm", "hits", "falls")
    rows = [
        (
            VEHICLES[c.vehicle].label,
            c.task,
            c.strategy,
            f"{c.successes}/{c.trials}",
            f"{c.time:.1f}",
            f"{100 * c.error:.1f}",
            f"{100 * c.worst:.1f}",
            f"{c.work:.1f}",
            f"{100 * c.slip:.1f}",
            str(c.touched),
            str(c.falls),
        )
        for c in found
    ]
    return _aligned([head, *rows], words=3)


@dataclass(frozen=True)
class WalkCell:
    """Walks of one gait on one ground in one direction; the largest coast and drift [m]."""

    vehicle: str
    scene: str
    direction: int
    walks: int
    successes: int
    falls: int
    shortest: float
    longest: float
    coast: float
    drift: float


def walk_cells(walks: Sequence[Walk]) -> list[WalkCell]:
    groups: dict[tuple[str, str, int], list[Walk]] = {}
    for walk in walks:
        groups.setdefault((walk.job.vehicle, walk.job.scene, walk.job.direction), []).append(walk)
    return [
        WalkCell(
            *key,
            walks=len(group),
            successes=sum(walk.success for walk in group),
            falls=sum(walk.fell for walk in group),
            shortest=min(walk.distance for walk in group),
            longest=max(walk.distance for walk in group),
            coast=max(walk.coast for walk in group),
            drift=max(walk.drift for walk in group),
        )
        for key, group in groups.items()
    ]


def walk_table(found: Sequence[WalkCell]) -> str:
    """Return the figures as a table for people."""
    head = ("gait", "ground", "way", "1 m", "falls", "shortest m", "longest m", "coast mm", "drift mm")
    rows = [
        (
            c.vehicle,
            c.scene,
            "forward" if c.direction > 0 else "backward",
            f"{c.successes}/{c.walks}",
            str(c.falls),
            f"{c.shortest:.2f}",
            f"{c.longest:.2f}",
            f"{1000 * c.coast:.0f}",
            f"{1000 * c.drift:.2f}",
        )
        for c in found
    ]
    return _aligned([head, *rows], words=3)


def _aligned(rows: Sequence[tuple[str, ...]], words: int) -> str:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells_ = [
            cell.ljust(width) if column < words else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(cells_).rstrip())
    lines.insert(1, "  " + "-" * (max(map(len, lines)) - 2))
    return "\n".join(lines) + "\n"
