"""What a fault did to a robot, from where it truly was: when it rested, when it drove again, what it drove in vain.

Times are seconds of this machine's monotonic clock, speeds metres and radians a second. Nothing here measures: a trace
and the moment of a fault go in, figures come out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

RESTING, RESTING_TURN = 0.01, math.radians(2.0)
"""Slower than this is at rest [m/s, rad/s]."""
REST_LASTS = 0.3
"""A robot that stands for so long has come to rest; less is a stutter [s]."""
GAP = 0.15
"""Samples further apart than this say nothing about the time between them [s], but that a robot stood which has not
left its place meanwhile."""
SAME_PLACE, SAME_YAW = 0.001, math.radians(0.1)
"""[m], [rad]"""


@dataclass(frozen=True)
class Sample:
    """Where a robot truly was.

    Args:
        time: Monotonic [s].
        x, y: In the world [m].
        yaw: In the world [rad].
        ahead: Velocity along its own heading [m/s].
        speed: Of the base over the ground [m/s].
        turn: Counter-clockwise [rad/s].
    """

    time: float
    x: float
    y: float
    yaw: float
    ahead: float
    speed: float
    turn: float

    @property
    def moves(self) -> bool:
        return self.speed > RESTING or abs(self.turn) > RESTING_TURN


def rest_time(trace: Sequence[Sample], since: float) -> float | None:
    """Return how long after `since` the robot came to rest [s], 0 if it stood already; None if it has not, or nobody
    could see it."""
    began: float | None = None
    before: Sample | None = None
    for sample in trace:
        if sample.time < since:
            continue
        if sample.moves or (before is not None and sample.time - before.time > GAP and not _stood(before, sample)):
            began = None
        if not sample.moves and began is None:
            began = sample.time
        before = sample
        if began is not None and sample.time - began >= REST_LASTS:
            return began - since
    return None


def _stood(before: Sample, after: Sample) -> bool:
    return math.hypot(after.x - before.x, after.y - before.y) < SAME_PLACE and abs(after.yaw - before.yaw) < SAME_YAW


def drive_time(trace: Iterable[Sample], since: float, speed: float) -> float | None:
    """Return how long after `since` the robot drove at `speed` at least [m/s]; None if it did not."""
    return next((sample.time - since for sample in trace if sample.time >= since and sample.speed >= speed), None)


def path_length(trace: Sequence[Sample], begin: float, end: float = math.inf) -> float:
    """Return how far the robot drove from `begin` to `end` while it moved; what a standing one trembles does not
    count [m]."""
    within = [sample for sample in trace if begin <= sample.time <= end]
    return sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in itertools.pairwise(within) if a.moves or b.moves)


def way_ahead(trace: Sequence[Sample], begin: float, end: float = math.inf) -> float:
    """Return how far the robot drove forward from `begin` to `end`; backward and turning do not count [m]."""
    within = [sample for sample in trace if begin <= sample.time <= end]
    return sum(a.ahead * min(b.time - a.time, GAP) for a, b in itertools.pairwise(within) if a.ahead > RESTING)
