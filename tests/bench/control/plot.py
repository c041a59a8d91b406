"""Pictures of the control benchmark: true paths on the floor, and errors, work and success side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from control.figures import Cell
from control.run import STRATEGIES, Trial
from control.tasks import TASKS
from control.vehicles import VEHICLES

COLOURS = {"open loop": "#d1495b", "open loop, gate": "#edae49", "odometry": "#00798c", "odometry, gate": "#30638e"}
_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#777777",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "savefig.dpi": 110,
}
_HIGHEST = 50.0
"""Larger errors leave the picture, with their figure next to the bar [cm]."""
_LEGEND = 0.4
"""Height left for it [inch]."""
_SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))


def draw_paths(path: Path, trials: Sequence[Trial]) -> None:
    """Where the robots really went on the square: a panel for each robot, a line for each seed.

    Args:
        trials: Of the task "square", at least one.
    """
    vehicles = [v for v in VEHICLES if any(t.job.vehicle == v for t in trials)]
    with plt.rc_context(_STYLE):
        figure, panels = plt.subplots(1, len(vehicles), figsize=(max(5.0, 3.0 * len(vehicles)), 3.5), squeeze=False)
        for panel, vehicle in zip(panels[0], vehicles, strict=True):
            panel.plot(*zip(*_SQUARE, strict=True), color="#999999", linewidth=5, alpha=0.35, solid_joinstyle="round")
            for trial in trials:
                if trial.job.vehicle != vehicle or STRATEGIES[trial.job.strategy].gate:
                    continue
                colour = COLOURS[trial.job.strategy]
                panel.plot(*zip(*trial.track, strict=True), color=colour, linewidth=1.1, alpha=0.8)
                panel.plot(*trial.track[-1], "o", color=colour, markersize=4)
            panel.set(title=VEHICLES[vehicle].label, aspect="equal", xlim=(-0.6, 1.6), ylim=(-0.6, 1.6), xlabel="x [m]")
        panels[0][0].set_ylabel("y [m]")
        lines = [plt.Line2D([], [], color=COLOURS[name], linewidth=2) for name in ("open loop", "odometry")]
        asked = plt.Line2D([], [], color="#999999", linewidth=5, alpha=0.35)
        figure.legend([asked, *lines], ["asked for", "open loop", "odometry"], loc="lower center", ncols=3)
        figure.tight_layout(rect=(0.0, _LEGEND / figure.get_figheight(), 1.0, 1.0))
        figure.savefig(path)
        plt.close(figure)


def draw_figures(path: Path, found: Sequence[Cell]) -> None:
    """Mean error (bar) and worst (tick) of every task and strategy, with what failed; a row for each robot."""
    vehicles = [v for v in VEHICLES if any(c.vehicle == v for c in found)]
    with plt.rc_context(_STYLE):
        figure, panels = plt.subplots(len(vehicles), 2, figsize=(11.0, 2.3 * len(vehicles) + 0.5), squeeze=False)
        for row, vehicle in zip(panels, vehicles, strict=True):
            own = [c for c in found if c.vehicle == vehicle]
            _bars(row[0], own, "error", 100.0)
            row[0].set(ylabel="cm")
            row[0].set_title(f"{VEHICLES[vehicle].label}: error", loc="left", pad=14)
            row[0].set_ylim(0.0, _HIGHEST)
            _bars(row[1], own, "work", 1.0)
            row[1].set(ylabel="J")
            row[1].set_title(f"{VEHICLES[vehicle].label}: work of the drives", loc="left", pad=14)
        handles = [plt.Rectangle((0, 0), 1, 1, color=colour) for colour in COLOURS.values()]
        figure.legend(handles, list(COLOURS), loc="lower center", ncols=4)
        figure.tight_layout(rect=(0.0, _LEGEND / figure.get_figheight(), 1.0, 1.0))
        figure.savefig(path)
        plt.close(figure)


def _bars(panel: plt.Axes, own: Sequence[Cell], quantity: str, scale: float) -> None:
    tasks = [task for task in TASKS if any(c.task == task for c in own)]
    strategies = [name for name in STRATEGIES if any(c.strategy == name for c in own)]
    width = 0.8 / len(strategies)
    for cell in own:
        place = tasks.index(cell.task) + (strategies.index(cell.strategy) - 0.5 * (len(strategies) - 1)) * width
        height = scale * getattr(cell, quantity)
        panel.bar(place, height, 0.9 * width, color=COLOURS[cell.strategy])
        if quantity != "error":
            continue
        worst = min(scale * cell.worst, _HIGHEST)
        panel.plot([place - 0.35 * width, place + 0.35 * width], [worst] * 2, color="#333333", linewidth=1.0)
        failed = cell.trials - cell.successes
        notes = [f"{height:.0f}"] if height > _HIGHEST else []
        notes += [f"{failed}✕"] if failed else []
        panel.annotate(
            "\n".join(notes), (place, worst), (0, 2), textcoords="offset points", ha="center", fontsize=7,
            linespacing=0.9, color="#b00020", annotation_clip=False,
        )  # fmt: skip
    panel.set_xticks(range(len(tasks)), tasks)
    panel.grid(axis="x", visible=False)
