"""The table of faults: a row for each victim, fault and way of driving."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from report import percentile

from .trial import NOBODY, Outcome

REST = {"pepper": 0.6, "robotino": 0.5}
"""Limits for rest [s]: Pepper's base brakes with 0.55 m/s², which takes longer than half a second from 0.35 m/s."""
REVERSED = {"pepper": 0.6, "robotino": 0.6}
"""The same where nothing is lost and the pilot reverses: Robotino's base goes through zero by its own ramp of 0.4 m/s²,
which alone takes 0.5 s from 0.2 m/s."""
REST_LOADED = 0.7
TOLD, BACK = 1.0, 3.0
STALE = 0.001
"""Less than a millimetre is no motion [m]."""
EDGE = 0.005
"""Figures are judged as they are printed, to a hundredth of a second."""


@dataclass(frozen=True)
class Figures:
    """One row: several of one fault."""

    station: str
    robot: str
    by: str
    victim: str
    fault: str
    outcomes: tuple[Outcome, ...]
    load: bool = False

    @property
    def rests(self) -> list[float]:
        """Seconds to rest of the robots that the fault stopped."""
        return [o.rest for o in self.outcomes if o.rest is not None]

    @property
    def releases(self) -> list[float]:
        return [math.inf if o.release is None else o.release for o in self.outcomes if o.goes_on]

    @property
    def backs(self) -> list[float]:
        return [math.inf if o.back is None else o.back for o in self.outcomes if not o.goes_on]

    @property
    def tolds(self) -> list[float]:
        heard = [o for o in self.outcomes if o.victim != NOBODY and not (o.harmless and o.told is None)]
        return [math.inf if o.told is None else o.told for o in heard]

    @property
    def stale(self) -> float:
        """The longest [m]."""
        return max(o.stale for o in self.outcomes)

    @property
    def rest_limit(self) -> float:
        if self.load:
            return REST_LOADED
        return REVERSED[self.robot] if self.fault == "reset, key reversed" else REST[self.robot]

    @property
    def broken(self) -> list[str]:
        """The limits that this row breaks. A key in Robotino's terminal has no release that anybody could see: how long
        its last repetition lasts is judged where the keyboard programs are."""
        found = []
        unseen = self.by == "terminal" and self.robot == "robotino"
        stopping = self.rests + ([] if unseen else self.releases)
        if stopping and spread(stopping)[1] > self.rest_limit + EDGE:
            found.append(f"rest > {self.rest_limit:g}")
        if self.tolds and max(self.tolds) > TOLD + EDGE:
            found.append(f"told > {TOLD:g}")
        if self.backs and max(self.backs) > BACK + EDGE:
            found.append(f"back > {BACK:g}")
        if self.stale >= STALE:
            found.append("stale > 0")
        return found

    def as_dict(self) -> dict:
        return {
            "station": self.station,
            "robot": self.robot,
            "by": self.by,
            "victim": self.victim,
            "fault": self.fault,
            "load": self.load,
            "times": len(self.outcomes),
            "rest": spread(self.rests),
            "release": spread(self.releases),
            "told": spread(self.tolds),
            "back": spread(self.backs),
            "stale_mm": self.stale * 1e3,
            "rest_limit": self.rest_limit,
            "broken": self.broken,
        }


def rows(outcomes: Iterable[Outcome], load: bool = False) -> list[Figures]:
    """Group outcomes into rows, in the order of their first one."""
    groups: dict[tuple[str, ...], list[Outcome]] = {}
    for o in outcomes:
        groups.setdefault((o.station, o.robot, o.by, o.victim, o.fault), []).append(o)
    return [Figures(*key, tuple(group), load) for key, group in groups.items()]


def spread(values: Sequence[float]) -> tuple[float, float, float] | tuple[()]:
    """p50, p95 and the largest; nothing of nothing. What never came is infinite, and stays so."""
    if not values:
        return ()
    if len(values) == 1 or not all(map(math.isfinite, values)):
        ordered = sorted(values)
        late = ordered[min(len(ordered) - 1, math.ceil(0.95 * len(ordered)) - 1)]
        return (statistics.median_low(ordered), late, ordered[-1])
    return (percentile(values, 50), percentile(values, 95), max(values))


HEAD = ("station", "robot", "by", "victim", "fault", "n", "rest", "release", "told", "back", "stale", "breaks")


def table(figures: Sequence[Figures]) -> str:
    """Text for people, seconds and millimetres: p50, p95, largest."""
    lines = [HEAD, *map(cells, figures)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
    text = ["  ".join(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    text.insert(1, "-" * max(map(len, text)))
    return "\n".join(text) + "\n"


def cells(row: Figures) -> tuple[str, ...]:
    """The texts of a row, in the order of HEAD."""
    gone = any(o.gone for o in row.outcomes)
    return (
        row.station,
        row.robot,
        row.by + (", load" if row.load else ""),
        row.victim,
        row.fault,
        str(len(row.outcomes)),
        _cell(row.rests) or ("gone" if gone else "goes on"),
        _cell(row.releases),
        _cell(row.tolds),
        _cell(row.backs),
        f"{row.stale * 1e3:.0f} mm",
        ", ".join(row.broken),
    )


def limits(load: bool = False) -> str:
    """What the rows are held to, in words."""
    rest = f"{REST_LOADED:g} s" if load else ", ".join(f"{name} {limit:g} s" for name, limit in REST.items())
    return (
        f"p50, p95 and largest [s]. Limits: rest p95 {rest} (also after the release of a robot that goes on; Pepper's "
        "base alone takes 0.64 s from 0.35 m/s), 0.6 s for a key that is reversed without a fault (Robotino's base "
        f"alone takes 0.5 s from 0.2 m/s), told {TOLD:g} s, back {BACK:g} s, stale motion 0 mm."
    )


def summary(figures: Sequence[Figures]) -> str:
    """One line: how many rows hold."""
    holding = sum(not row.broken for row in figures)
    faults = sum(len(row.outcomes) for row in figures)
    stale = sum(o.stale >= STALE for row in figures for o in row.outcomes)
    return f"{holding} of {len(figures)} rows hold; {faults} faults, {stale} with stale motion"


def _cell(values: Sequence[float]) -> str:
    parts = spread(values)[: 3 if len(values) > 1 else 1]
    return " ".join("never" if math.isinf(part) else f"{part:.2f}" for part in parts)
