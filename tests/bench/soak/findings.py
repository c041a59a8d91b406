"""What a soak's record says: growth of every program, processor shares, restarts, and which limits are broken."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from soak.growth import BINS, Growth, growth
from soak.record import Record, Series

SMALL = 256.0
"""Memory that grows by less than this [kB/h] is not counted as growing, whatever share of a small program it is."""


@dataclass(frozen=True)
class Limits:
    """Growth an hour that is allowed: of memory [%], and of descriptors and threads."""

    memory: float
    count: float


LONG_LIMITS = Limits(memory=1.0, count=0.5)
SHORT_LIMITS = Limits(memory=10.0, count=4.0)
"""Minutes cannot tell a slow leak from caches that fill."""
LONG = 2 * 3600.0
"""Duration [s] from which on growth counts after the first hour; in shorter runs the first quarter does not count."""
SETTLE = 600.0
"""The first part of each life of a program that does not count in a long run [s]."""
FEWEST_PAIRS = 15
"""Fewer pairs of points say nothing."""
FIELDS = {"rss": "memory [kB]", "descriptors": "descriptors", "threads": "threads"}


@dataclass(frozen=True)
class Program:
    """One program over the whole run; shares of a processor are between 0 and 1, or more with several threads."""

    name: str
    lives: int
    rss: float
    growths: dict[str, Growth]
    idle: float
    driving: float


@dataclass(frozen=True)
class Findings:
    """All that the report says."""

    duration: float
    since: float
    programs: list[Program]
    total: Growth
    log_written: float
    log_size: int
    metres: list[float]
    tracebacks: list[tuple[str, str, int]]
    counts: dict[str, int]
    broken: list[str]

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def find(record: Record) -> Findings:
    """Return what the record says."""
    duration = record.duration
    long = duration >= LONG
    since = 3600.0 if long else duration / 4.0
    settle = SETTLE if long else min(120.0, duration / 8.0)
    width = max((duration - since) / BINS, 1.0)
    programs = [
        _program(name, series, settle, since, width)
        for name, series in sorted(record.programs.items())
        if len(series.times) >= 5
    ]
    totals = np.array([(line["t"], line["pss"]) for line in record.totals])
    total = growth([totals] if len(totals) else [], 0.0, since, width)
    last = record.totals[-1] if record.totals else {}
    tracebacks = [(file, text, count) for file, text, count in last.get("tracebacks", [])]
    counts: dict[str, int] = {}
    for _, kind, _ in record.events:
        counts[kind] = counts.get(kind, 0) + 1
    return Findings(
        duration=duration,
        since=since,
        programs=programs,
        total=total,
        log_written=last.get("log_written", 0) / max(duration, 1.0) * 3600.0,
        log_size=last.get("log_size", 0),
        metres=last.get("metres", []),
        tracebacks=tracebacks,
        counts=counts,
        broken=_broken(programs, total, tracebacks, record, LONG_LIMITS if long else SHORT_LIMITS),
    )


def grows(found: Growth, least: float) -> bool:
    """Whether a figure grows by at least so much an hour, and this is no accident of the samples."""
    return found.pairs >= FEWEST_PAIRS and found.slope >= least and found.low > 0.0


def memory_limit(found: Growth, limits: Limits) -> float:
    """Return the growth that breaks the limit, for a program of this size [kB/h]."""
    return max(SMALL, found.level * limits.memory / 100.0)


def _program(name: str, series: Series, settle: float, since: float, width: float) -> Program:
    return Program(
        name=name,
        lives=len({usage.life for usage in series.usages}),
        rss=float(np.median([usage.rss for usage in series.usages])),
        growths={what: growth(series.lives(what), settle, since, width) for what in FIELDS},
        idle=series.share("idle"),
        driving=series.share("driving"),
    )


def _broken(programs: list[Program], total: Growth, tracebacks: list, record: Record, limits: Limits) -> list[str]:
    found = []
    if grows(total, memory_limit(total, limits)):
        found.append(f"the station's memory grows by {100.0 * total.slope / total.level:.2f} % an hour")
    for program in programs:
        for what, least in (
            ("rss", memory_limit(program.growths["rss"], limits) if program.growths["rss"].known else math.inf),
            ("descriptors", limits.count),
            ("threads", limits.count),
        ):
            if grows(program.growths[what], least):
                grown = program.growths[what]
                found.append(
                    f"{program.name}: {FIELDS[what]} grows by {grown.slope:.3g} an hour "
                    f"({grown.low:.3g} to {grown.high:.3g})"
                )
    found += [f"{count} x traceback in {file}: {text}" for file, text, count in tracebacks]
    bad = ("not back", "station ended", "event failed")
    found += [f"{kind} at {at:.0f} s: {text}" for at, kind, text in record.events if kind in bad]
    return found
