"""Which floor around the robot has been looked at lately: a small map that moves along with the robot."""

from __future__ import annotations

import math

import numpy as np

from .outline import Outline
from .scan import Scan

CELL = 0.04
"""Edge of a cell [m]."""
CELLS = 64
"""Cells per side; the map wraps around, so it covers 2.56 m centred on wherever the robot is."""
LOOK = 1.0
"""Beams are followed this far [m]."""
LASTING = 30.0
"""What was seen longer ago counts as unseen [s]."""
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
        self._outline = outline
        self._marked = np.full(2, math.inf)

    def clear(self) -> None:
        self._when[:] = -math.inf
        self._marked[:] = math.inf

    def look(self, scan: Scan, clock: float) -> None:
        """Mark what the beams of a scan (odometry frame) pass."""
        reach = scan.free[:, None] > self._steps
        beam, step = np.nonzero(reach)
        self._mark(scan.origins[beam] + self._steps[step, None] * scan.directions[beam], clock)

    def stand(self, x: float, y: float, theta: float, clock: float) -> None:
        """Mark the floor under the robot: it is there, so it is free."""
        if math.hypot(x - self._marked[0], y - self._marked[1]) > 0.5 * CELL:
            self._marked[:] = x, y
            self._mark(_place(self._body, x, y, theta), clock)

    def strip_seen(self, pose: tuple[float, float, float], ux: float, uy: float, length: float, clock: float) -> bool:
        """True if the floor that driving `length` [m] along (ux, uy) (base_link) would sweep has been seen."""
        half = self._outline.half_width(math.atan2(uy, ux))
        across = np.linspace(-half, half, 11)[1:-1]
        rim = np.sqrt(np.maximum(self._outline.outer_radius**2 - across**2, 0.0))
        ahead = (rim[:, None] + np.linspace(CELL, length, max(2, math.ceil(length / CELL)))).ravel()
        across = np.repeat(across, len(ahead) // len(across))
        strip = np.stack([ahead * ux - across * uy, ahead * uy + across * ux], axis=1)
        index, place = _cells(_place(strip, *pose))
        seen = (self._place[index] == place) & (self._when[index] > clock - LASTING)
        return bool(seen.mean() >= ENOUGH)

    def _mark(self, points: np.ndarray, clock: float) -> None:
        index, place = _cells(points)
        self._place[index] = place
        self._when[index] = clock


def _place(points: np.ndarray, x: float, y: float, theta: float) -> np.ndarray:
    c, s = math.cos(theta), math.sin(theta)
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def _cells(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index into the map, and the number of the cell on the unbounded floor that lies there."""
    cell = np.floor(points * (1.0 / CELL)).astype(np.int64)
    wrapped = cell % CELLS
    return wrapped[:, 0] * CELLS + wrapped[:, 1], (cell[:, 0] << 32) ^ (cell[:, 1] & 0xFFFFFFFF)
