"""Rows of a benchmark, and the table that people read."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Row:
    """One figure of ours and its reference, in the same unit and from the same run."""

    metric: str
    ours: float
    reference: float
    unit: str
    reference_name: str

    @property
    def ratio(self) -> float:
        return self.ours / self.reference if self.reference else math.nan

    def as_dict(self) -> dict:
        return {**asdict(self), "ratio": self.ratio}


def table(rows: Sequence[Row]) -> str:
    cells = [("metric", "ours", "reference", "ratio", "unit", "against")]
    cells += [
        (r.metric, _digits(r.ours), _digits(r.reference), f"{r.ratio:.3f}", r.unit, r.reference_name) for r in rows
    ]
    widths = [max(len(row[column]) for row in cells) for column in range(len(cells[0]))]
    lines = []
    for row in cells:
        numbers = (f"{cell:>{width}}" for cell, width in zip(row[1:4], widths[1:4], strict=True))
        words = (f"{cell:<{width}}" for cell, width in zip(row[4:], widths[4:], strict=True))
        lines.append(f"  {row[0]:<{widths[0]}}  " + "  ".join((*numbers, *words)).rstrip())
    lines.insert(1, "  " + "-" * (max(map(len, lines)) - 2))
    return "\n".join(lines) + "\n"


def percentile(values: Sequence[float], percent: int) -> float:
    """The value below which `percent` of the values lie (inclusive method)."""
    return statistics.quantiles(values, n=100, method="inclusive")[percent - 1]


def _digits(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"
