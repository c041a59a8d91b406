"""How fast a figure grows, from samples of programs that are restarted now and then.

Theil-Sen: the median of the slopes between all pairs of samples, so that neither a peak nor a step decides. Only pairs
of one life of a program count, and none from its first minutes, in which it fills its caches. The interval is Sen's:
P. K. Sen, Estimates of the regression coefficient based on Kendall's tau, J. Am. Stat. Assoc. 63 (1968), for strata.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONFIDENCE = 1.96
"""Standard deviations of 95 %."""
BINS = 60
"""Points of a whole run: medians of what was sampled meanwhile, as neighbouring samples say nearly the same."""


@dataclass(frozen=True)
class Growth:
    """A slope with its interval of 95 % [units per hour], the level it starts from, and the pairs it rests on."""

    slope: float
    low: float
    high: float
    level: float
    pairs: int

    @property
    def known(self) -> bool:
        return math.isfinite(self.slope)


UNKNOWN = Growth(math.nan, math.nan, math.nan, math.nan, 0)


def growth(lives: Sequence[np.ndarray], settle: float, since: float, bin_width: float) -> Growth:
    """Return how fast a figure grows.

    Args:
        lives: For each life of a program its samples, (n, 2): time [s] and value.
        settle: The first part of each life that does not count [s].
        since: Time of the first sample that counts in any life [s].
        bin_width: Samples of so many seconds become one point.
    """
    slopes, variance, levels = [], 0.0, []
    for samples in lives:
        if not len(samples):
            continue
        taken = samples[samples[:, 0] >= max(since, samples[0, 0] + settle)]
        points = _binned(taken, bin_width)
        n = len(points)
        levels += [value for _, value in points]
        if n < 3:
            continue
        i, j = np.triu_indices(n, 1)
        slopes.append((points[j, 1] - points[i, 1]) / (points[j, 0] - points[i, 0]) * 3600.0)
        variance += n * (n - 1) * (2 * n + 5) / 18.0
    if not slopes:
        return UNKNOWN
    found = np.sort(np.concatenate(slopes))
    count, reach = len(found), CONFIDENCE * math.sqrt(variance)
    low, high = math.floor((count - reach) / 2.0), math.ceil((count + reach) / 2.0)
    return Growth(
        slope=float(np.median(found)),
        low=float(found[low]) if low >= 0 else -math.inf,
        high=float(found[high]) if high < count else math.inf,
        level=float(np.median(levels)),
        pairs=count,
    )


def _binned(samples: np.ndarray, width: float) -> np.ndarray:
    """Medians of time and value of each `width` seconds."""
    if not len(samples):
        return samples
    bins = np.floor((samples[:, 0] - samples[0, 0]) / width)
    return np.array([np.median(samples[bins == each], axis=0) for each in np.unique(bins)])
