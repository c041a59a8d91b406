"""Trajectories: lines and arcs of circles that the base drives in given times, as ALNavigation.moveAlong takes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

ARC_STEP = math.radians(10.0)
"""An arc is driven as straight pieces of this angle [rad]."""
MAX_PIECES = 1000
"""Lines, and straight pieces of arcs, that a trajectory may have in all its parts together."""

Waypoint = tuple[float, float, float]


class BadTrajectory(ValueError):
    """A value is not a trajectory; the text says what is wrong with it."""


@dataclass(frozen=True)
class Trajectory:
    """Poses (x, y, theta [m, rad]) relative to the pose at the start, the last one reached after `duration` [s]."""

    waypoints: tuple[Waypoint, ...]
    duration: float


def read_trajectory(value: Any) -> list[Trajectory]:
    """Read ["Holonomic", path, theta, time] or ["Composed", trajectory, ...]; each starts where the one before ends.

    A path is ["Line", [x, y]], ["Circle", [x, y], angle] about that centre, or ["Composed", path, ...].

    Raises:
        BadTrajectory: It is none.
    """
    name, *parts = _named(value, "a trajectory")
    if name == "Composed":
        composed: list[Trajectory] = []
        for part in _parts(parts):
            composed += read_trajectory(part)
            if sum(len(piece.waypoints) for piece in composed) > MAX_PIECES:
                raise BadTrajectory(f"a trajectory has at most {MAX_PIECES} pieces")
        return composed
    if name != "Holonomic" or len(parts) != 3:
        raise BadTrajectory('a trajectory is ["Holonomic", path, theta, time] or ["Composed", trajectory, ...]')
    path, theta, duration = parts[0], _number(parts[1], "theta"), _number(parts[2], "time")
    if duration <= 0.0:
        raise BadTrajectory(f"the time must be positive, got {duration:g}")
    corners = _corners(path, (0.0, 0.0))
    lengths = [math.dist(a, b) for a, b in zip([(0.0, 0.0), *corners[:-1]], corners, strict=True)]
    whole, gone, waypoints = sum(lengths), 0.0, []
    for (x, y), length in zip(corners, lengths, strict=True):
        gone += length
        waypoints.append((x, y, theta * (gone / whole if whole > 0.0 else 1.0)))
    return [Trajectory(tuple(waypoints), duration)]


def _corners(path: Any, start: tuple[float, float]) -> list[tuple[float, float]]:
    """Return the corners of a path that begins at `start`, without it."""
    name, *parts = _named(path, "a path")
    if name == "Composed":
        corners: list[tuple[float, float]] = []
        for part in _parts(parts):
            corners += _corners(part, corners[-1] if corners else start)
            if len(corners) > MAX_PIECES:
                raise BadTrajectory(f"a path has at most {MAX_PIECES} pieces")
        return corners
    if name == "Line" and len(parts) == 1:
        x, y = _point(parts[0])
        return [(start[0] + x, start[1] + y)]
    if name == "Circle" and len(parts) == 2:
        x, y = _point(parts[0])
        span = _number(parts[1], "the angle of a circle")
        count = max(1, math.ceil(abs(span) / ARC_STEP))
        if count > MAX_PIECES:
            raise BadTrajectory(f"a circle of {span:g} rad is too long")
        centre = (start[0] + x, start[1] + y)
        turns = [span * (i + 1) / count for i in range(count)]
        return [
            (
                centre[0] - x * math.cos(turn) + y * math.sin(turn),
                centre[1] - x * math.sin(turn) - y * math.cos(turn),
            )
            for turn in turns
        ]
    raise BadTrajectory('a path is ["Line", [x, y]], ["Circle", [x, y], angle] or ["Composed", path, ...]')


def _named(value: Any, what: str) -> list[Any]:
    if not isinstance(value, list | tuple) or not value or not isinstance(value[0], str):
        raise BadTrajectory(f"{what} is a list that begins with its name")
    return list(value)


def _parts(parts: list[Any]) -> list[Any]:
    """Return the parts of what is composed: they follow its name, or are one list behind it."""
    if len(parts) == 1 and isinstance(parts[0], list | tuple) and parts[0] and not isinstance(parts[0][0], str):
        parts = list(parts[0])
    if not parts:
        raise BadTrajectory('"Composed" needs at least one part')
    return parts


def _point(value: Any) -> tuple[float, float]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise BadTrajectory("a point is [x, y]")
    return _number(value[0], "x"), _number(value[1], "y")


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadTrajectory(f"{what} must be a finite number")
    return float(value)
