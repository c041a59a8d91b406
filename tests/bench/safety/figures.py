"""From counts to figures: collisions per 1000 commands and per 100 m with bounds, and everything shown with them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from safety.run import Outcome
from safety.worlds import KINDS, PERSON

RESAMPLES = 2000
"""Number of resamples of the bootstrap."""
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Rate:
    """Events per exposure with a 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Figures:
    """One gate on one robot.

    Args:
        scenarios, commands: Exposure.
        driven: [m].
        hits: Collisions with things that stand.
        blind_hits: ... of these, on a side of the body where no beam points.
        person_hits: Collisions with people in which the robot moved towards them.
        walked_into: People who ran into a robot that stood or went away.
        per_1000, per_100_m: Collisions with things that stand.
        by_kind: Collisions by what was hit.
        hardest: Fastest collision with anything [m/s].
        gap_5, gap_50: Least clearance of a scenario: 5th and 50th percentile [m].
        passed: Share of the commanded speed that was let through.
        standing: Share of the commanded time spent below 2 cm/s.
        goals: Reached per 100 m that were asked for.
        changes: Of the shown state per minute.
        stopped_after: Longest time from a fault to the gate's zero [s]; NaN without a fault.
    """

    scenarios: int
    commands: int
    driven: float
    hits: int
    blind_hits: int
    person_hits: int
    walked_into: int
    per_1000: Rate
    per_100_m: Rate
    by_kind: dict[str, int]
    hardest: float
    gap_5: float
    gap_50: float
    passed: float
    standing: float
    goals: float
    changes: float
    stopped_after: float


def figures(outcomes: Sequence[Outcome], tick: float) -> Figures:
    """Sum up batches.

    Args:
        tick: Of the gate [s].
    """
    all_of = {
        field.name: np.concatenate([getattr(outcome, field.name) for outcome in outcomes])
        for field in fields(Outcome)
        if field.name != "contacts"
    }
    contacts = [contact for outcome in outcomes for contact in outcome.contacts]
    static = all_of["hits"].sum(axis=1) - all_of["hits"][:, PERSON]
    commands, driven, asking = all_of["commands"].sum(), all_of["driven"].sum(), all_of["asking"].sum()
    asked = all_of["asked"].sum()
    stopped = all_of["stopped_after"]
    return Figures(
        scenarios=len(static),
        commands=int(commands),
        driven=float(driven),
        hits=int(static.sum()),
        blind_hits=sum(contact.blind for contact in contacts if contact.kind != PERSON),
        person_hits=int(all_of["hits"][:, PERSON].sum()),
        walked_into=int(all_of["walked_into"].sum()),
        per_1000=rate(static, all_of["commands"] / 1000.0),
        per_100_m=rate(static, all_of["driven"] / 100.0),
        by_kind=dict(zip(KINDS, all_of["hits"].sum(axis=0).astype(int).tolist(), strict=True)),
        hardest=float(all_of["hardest"].max()),
        gap_5=float(np.percentile(all_of["gap"], 5)),
        gap_50=float(np.percentile(all_of["gap"], 50)),
        passed=float(all_of["passed"].sum() / asked),
        standing=float(all_of["standing"].sum() / asking),
        goals=float(100.0 * all_of["goals"].sum() / (asked * tick)),
        changes=float(all_of["changes"].sum() / (asking * tick / 60.0)),
        stopped_after=float(np.nanmax(stopped)) if np.isfinite(stopped).any() else math.nan,
    )


def rate(events: np.ndarray, exposure: np.ndarray) -> Rate:
    """Events of scenarios (n,) per their exposure, with the wider of two intervals.

    Poisson's exact one holds for few events; the bootstrap over scenarios for events that come in bunches.
    """
    count, total = int(events.sum()), float(exposure.sum())
    low, high = poisson_interval(count)
    low, high = low / total, high / total
    if count:
        picks = np.random.default_rng(0).integers(len(events), size=(RESAMPLES, len(events)))
        resampled = events[picks].sum(axis=1) / exposure[picks].sum(axis=1)
        tail = 50.0 * (1.0 - CONFIDENCE)
        low = min(low, float(np.percentile(resampled, tail)))
        high = max(high, float(np.percentile(resampled, 100.0 - tail)))
    return Rate(count / total, low, high)


def poisson_interval(count: int) -> tuple[float, float]:
    """Means for which `count` events are just not too many or too few; for none the one-sided bound, 3.0."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    if count == 0:
        return 0.0, -math.log(1.0 - CONFIDENCE)
    return _solve(count - 1, 1.0 - tail), _solve(count, tail)


def _solve(count: int, chance: float) -> float:
    """The mean at which at most `count` events have this chance."""
    low, high = 0.0, 10.0 + 4.0 * count
    for _ in range(60):
        middle = 0.5 * (low + high)
        terms = np.arange(count + 1)
        logs = terms * math.log(middle) - middle - np.array([math.lgamma(k + 1) for k in terms])
        low, high = (middle, high) if np.exp(logs).sum() > chance else (low, middle)
    return 0.5 * (low + high)


def table(rows: Sequence[tuple[str, Figures]]) -> str:
    """Return a table for people; gates by row."""
    head = ("gate", "commands", "hits", "per 1000", "95 %", "per 100 m", "people", "passed", "stood", "goals",
            "gap 5 %", "hardest")  # fmt: skip
    cells = [head]
    for name, f in rows:
        cells.append(
            (
                name,
                f"{f.commands:,}",
                f"{f.hits}" + (f" ({f.blind_hits} blind)" if f.blind_hits else ""),
                f"{f.per_1000.value:.3f}",
                f"{f.per_1000.low:.3f}-{f.per_1000.high:.3f}",
                f"{f.per_100_m.value:.2f}",
                f"{f.person_hits}+{f.walked_into}",
                f"{100 * f.passed:.1f} %",
                f"{100 * f.standing:.1f} %",
                f"{f.goals:.1f}",
                f"{100 * f.gap_5:.1f} cm",
                f"{f.hardest:.2f} m/s",
            )
        )
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    lines = [
        f"  {row[0]:<{widths[0]}}" + "".join(f"  {cell:>{w}}" for cell, w in zip(row[1:], widths[1:], strict=True))
        for row in cells
    ]
    lines.insert(1, "  " + "-" * (len(lines[0]) - 2))
    return "\n".join(lines)
