"""Which floor around the robot has been looked at lately: a small map that moves along with the robot."""

from __future__ import annotations

import math

import numpy as np

from .outline import Outline
from .plane import from_base
from .scan import Scan

CELL = 0.04
"""Edge of a cell [m]."""
CELLS = 64
"""Cells per side; the map wraps around, so it covers 2.56 m centred on wherever the robot is."""
LOOK = 0.8
"""Beams are followed this far [m]."""
LASTING = 30.0
"""What was seen longer ago counts as unseen [s]."""
ACROSS, ALONG = 9, 8
"""A strip is looked up at so many places."""
ENOUGH = 0.8
"""Share of a strip that must have been seen."""


class SeenFloor:
    """Cells that a beam or the robot itself has passed. Odometry frame; times on the owner's clock."""

    def __init__(self, outline: Outline) -> None:
        self._place = np.full(CELLS * CELLS, -1, np.int64)
        self._when = np.full(CELLS * CELLS, -math.inf)
        self._steps = np.arange(0.5 * CELL, LOOK, CELL)
        grid = np.arange(-outline.outer_radius, outline.outer_radius + CELL, CELL)
        inside = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
        self._body = inside[outline.measure(inside)[0] < 0.0]
        half = outline.outer_radius
        self._across = np.repeat(np.linspace(-half, half, ACROSS + 2)[1:-1], ALONG)
        self._rim = np.sqrt(half**2 - self._across**2) + CELL
        self._ahead = np.tile(np.linspace(0.0, 1.0, ALONG), ACROSS)
        self._marked = np.full(2, math.inf)

    def clear(self) -> None:
        self._when[:] = -math.inf
        self._marked[:] = math.inf

    def look(self, scan: Scan, clock: float) -> None:
        """Mark what the beams of a scan (odometry frame) pass, and what lies behind their returns.

        The way there leads through an obstacle, which is the guard's business.
        """
        looks = (scan.free >= LOOK) | np.isfinite(scan.ranges)
        reach = (scan.free[:, None] > self._steps) | looks[:, None]
        beam, step = np.nonzero(reach)
        self._mark(scan.origins[beam] + self._steps[step, None] * scan.directions[beam], clock)

    def stand(self, x: float, y: float, theta: float, clock: float) -> None:
        """Mark the floor under the robot: it is there, so it is free."""
        if math.hypot(x - self._marked[0], y - self._marked[1]) > 0.5 * CELL:
            self._marked[:] = x, y
            self._mark(from_base(self._body, x, y, theta), clock)

    def strip_seen(self, pose: tuple[float, float, float], ux: float, uy: float, length: float, clock: float) -> bool:
        """True if the floor that driving `length` [m] along (ux, uy) (base_link) would sweep has been seen."""
        ahead = self._rim + self._ahead * (length - CELL)
        strip = np.stack([ahead * ux - self._across * uy, ahead * uy + self._across * ux], axis=1)
        index, place = _cells(from_base(strip, *pose))
        seen = (self._place[index] == place) & (self._when[index] > clock - LASTING)
        return int(np.count_nonzero(seen)) >= ENOUGH * len(seen)

    def _mark(self, points: np.ndarray, clock: float) -> None:
        index, place = _cells(points)
        self._place[index] = place
        self._when[index] = clock


def _cells(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index into the map, and the number of the cell on the unbounded floor that lies there."""
    cell = np.floor(points * (1.0 / CELL)).astype(np.int64)
    wrapped = cell % CELLS
    return wrapped[:, 0] * CELLS + wrapped[:, 1], (cell[:, 0] << 32) ^ (cell[:, 1] & 0xFFFFFFFF)
