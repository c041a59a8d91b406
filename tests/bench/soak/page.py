"""The report of a soak: Markdown, plots and JSON, made from the record, again whenever it is wanted."""

from __future__ import annotations

import json
import math
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from soak.findings import Findings, find
from soak.growth import Growth
from soak.record import Record, read

SHOWN = 10
"""Programs that have a line of their own in a plot: the largest."""
FAULTS = {
    "kill",
    "back",
    "not back",
    "station ended",
    "station started",
    "robot's program restarted",
    "event failed",
    "link",
}
PLOTS = {"memory": "Memory", "counts": "Descriptors and threads", "processor": "Processor share", "logs": "Logs"}


def write(record_file: Path, folder: Path) -> Findings:
    """Write report.md, report.json and the plots into the folder; return what they say."""
    record = read(record_file)
    findings = find(record)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "report.json").write_text(json.dumps({"about": record.about, **findings.as_dict()}, indent=1))
    (folder / "report.md").write_text(text(record, findings))
    plot(record, findings, folder)
    return findings


def text(record: Record, findings: Findings) -> str:
    """Return the report as Markdown."""
    about = record.about
    total = findings.total
    percent = 100.0 * total.slope / total.level if total.known else math.nan
    lines = [
        f"# Soak: {findings.duration / 3600.0:.2f} hours",
        "",
        f"Seed {about.get('seed')}, {100 * about.get('loss', 0.0):g} % of the packets lost each way between pilot and "
        f"robots. {'' if about.get('kills', True) else 'No program is killed. '}{about.get('about', '')}",
        "",
        *(
            ["**Limits broken:**", "", *(f"* {each}" for each in findings.broken)]
            if findings.broken
            else ["**All limits hold.**"]
        ),
        "",
        f"* Memory of all programs together (PSS): {total.level / 1024.0:.0f} MB, growing by {percent:.2f} % an hour "
        f"{_interval(total, 100.0 / total.level if total.known else math.nan)} after the first "
        f"{findings.since / 60.0:.0f} minutes",
        f"* Driven: {', '.join(f'{metres:.0f} m' for metres in findings.metres) or 'not measured'} (Pepper, Robotino)",
        f"* Logs: {findings.log_written / 1e6:.1f} MB written an hour, {findings.log_size / 1e6:.1f} MB on the disk",
        "* Happened: " + ", ".join(f"{count} x {kind}" for kind, count in sorted(findings.counts.items())),
        "",
        *(f"![{title}]({name}.png)\n" for name, title in PLOTS.items()),
        "## Programs",
        "",
        "Growth an hour by Theil-Sen over pairs of samples of one life, with the interval of 95 %; processor in "
        "percent of one core. A dash: too few samples in one life.",
        "",
        "| program | lives | memory [MB] | growth [%/h] | descriptors [1/h] | threads [1/h] | idle [%] | driving [%] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for program in findings.programs:
        memory = program.growths["rss"]
        share = 100.0 / memory.level if memory.known and memory.level else math.nan
        lines.append(
            f"| {program.name} | {program.lives} | {program.rss / 1024.0:.1f} | {_cell(memory, share)} | "
            f"{_cell(program.growths['descriptors'])} | {_cell(program.growths['threads'])} | "
            f"{_percent(program.idle)} | {_percent(program.driving)} |"
        )
    lines += ["", "## Tracebacks", ""]
    lines += [f"* {count} x {file}: `{error}`" for file, error, count in findings.tracebacks] or ["None."]
    lines += ["", "## Restarts", ""]
    lines += [f"* {at:.0f} s: {kind}: {what}" for at, kind, what in record.events if kind in FAULTS]
    return "\n".join(lines) + "\n"


def plot(record: Record, findings: Findings, folder: Path) -> None:
    """Write the plots."""
    largest = sorted(findings.programs, key=lambda program: -program.rss)[:SHOWN]
    times = np.array([line["t"] for line in record.totals]) / 3600.0
    with plt.rc_context({"figure.figsize": (9, 4), "font.size": 9, "axes.grid": True, "grid.alpha": 0.3}):
        figure, (all_axes, axes) = plt.subplots(1, 2)
        all_axes.plot(times, [line["pss"] / 1024.0 for line in record.totals])
        all_axes.set(xlabel="hours", ylabel="all programs, PSS [MB]", ylim=(0, None))
        for program in largest:
            series = record.programs[program.name]
            values = [usage.rss / 1024.0 for usage in series.usages]
            axes.plot(np.array(series.times) / 3600.0, values, label=program.name, linewidth=1)
        axes.set(xlabel="hours", ylabel="RSS [MB]", ylim=(0, None))
        axes.legend(fontsize=6, ncols=2, loc="lower left")
        _save(figure, folder / "memory.png")

        figure, axis = plt.subplots()
        for what in ("descriptors", "threads", "programs"):
            axis.plot(times, [line[what] for line in record.totals], label=what)
        axis.set(xlabel="hours", ylim=(0, None))
        axis.legend(fontsize=6, ncols=2, loc="lower left")
        _save(figure, folder / "counts.png")

        busiest = sorted(findings.programs, key=lambda p: -np.nan_to_num(p.driving))[:20][::-1]
        figure, axis = plt.subplots(figsize=(9, 6))
        place = np.arange(len(busiest))
        for offset, phase in ((0.2, "driving"), (-0.2, "idle")):
            axis.barh(place + offset, [100.0 * np.nan_to_num(getattr(p, phase)) for p in busiest], 0.4, label=phase)
        axis.set_yticks(place, [program.name for program in busiest])
        axis.set(xlabel="% of one core")
        axis.legend(fontsize=6, ncols=2, loc="lower left")
        _save(figure, folder / "processor.png")

        figure, axis = plt.subplots()
        axis.plot(times, [line["log_written"] / 1e6 for line in record.totals], label="written")
        axis.plot(times, [line["log_size"] / 1e6 for line in record.totals], label="on the disk")
        axis.set(xlabel="hours", ylabel="MB", ylim=(0, None))
        axis.legend(fontsize=6, ncols=2, loc="lower left")
        _save(figure, folder / "logs.png")


def _save(figure: plt.Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _cell(found: Growth, factor: float = 1.0) -> str:
    return f"{found.slope * factor:.2f} {_interval(found, factor)}" if found.known else "–"


def _interval(found: Growth, factor: float = 1.0) -> str:
    return f"({found.low * factor:.2f} to {found.high * factor:.2f})"


def _percent(share: float) -> str:
    return "–" if math.isnan(share) else f"{100.0 * share:.1f}"
