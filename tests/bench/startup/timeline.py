"""Who computes when while the station starts: each program's use of the processors from `./stack up` to the picture."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from soak.samples import TICKS, program_name

from telepresence.station import processes

PERIOD = 0.05
"""Seconds between two looks at all programs, and the width of a column of the picture."""
LEAST = 0.05
"""A program that has used less [s] is not in the picture."""


@dataclass
class Timeline:
    """What the programs below one process use, sampled from /proc by a thread between `start` and `stop`.

    Attributes:
        used: Program -> [(seconds since the start, its processor time then [s])].
    """

    root: int
    begun: float
    used: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    _names: dict[int, str] = field(default_factory=dict)
    _ended: threading.Event = field(default_factory=threading.Event)

    def start(self) -> None:
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(PERIOD):
            self._look((self.root, *processes.descendants(self.root)))

    def _look(self, pids: Iterable[int]) -> None:
        now = time.monotonic() - self.begun
        sums: dict[str, float] = {}
        for pid in pids:
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # it has ended meanwhile
            words = [word for word in " ".join(words).split(" ") if word]
            if words:
                self._names[pid] = program_name(words)
            name = self._names.get(pid)
            if name:
                sums[name] = sums.get(name, 0.0) + (int(fields[11]) + int(fields[12])) / TICKS
        for name, used in sums.items():
            self.used.setdefault(name, []).append((now, used))


def draw(timeline: Timeline, marks: dict[str, float], path: Path) -> None:
    """Draw a row for each program, in the order in which they began: the darker, the more of a processor it has.

    Args:
        marks: What happened -> when [s since the start].
        path: Of the picture.
    """
    end = max(marks.values())
    rows = {name: points for name, points in timeline.used.items() if points[-1][1] - points[0][1] >= LEAST}
    names = sorted(rows, key=lambda name: rows[name][0][0])
    edges = np.arange(0.0, end + PERIOD, 2 * PERIOD)
    shares = np.full((len(names), len(edges) - 1), np.nan)
    for row, name in enumerate(names):
        times, used = np.array(rows[name]).T
        at = np.interp(edges, times, used, left=used[0], right=used[-1])
        shares[row] = np.diff(at) / (2 * PERIOD)
        shares[row, edges[1:] < times[0]] = np.nan
    figure, axes = plt.subplots(figsize=(10.0, 0.9 + 0.27 * len(names)), layout="constrained")
    mesh = axes.pcolormesh(edges, np.arange(len(names) + 1), shares, cmap="YlGnBu", vmin=0.0, vmax=1.0)
    axes.set_yticks(np.arange(len(names)) + 0.5, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("seconds since ./stack up")
    for text, when in marks.items():
        axes.axvline(when, color="#d1495b", linewidth=1.2)
        axes.annotate(
            text, (when, 0.0), xytext=(-4, 4), textcoords="offset points", ha="right", fontsize=8, color="#d1495b",
            annotation_clip=False,
        )  # fmt: skip
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    figure.colorbar(mesh, ax=axes, label=f"of one of {os.cpu_count()} processors", shrink=0.5, pad=0.01)
    figure.savefig(path, dpi=110)
    plt.close(figure)
