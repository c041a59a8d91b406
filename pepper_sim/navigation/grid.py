"""Occupancy grid: for every cell of the floor the odds that something stands there, as far as it was seen.

Two layers, because the sensors see different things. The lasers look over the floor and see legs, walls and free floor;
the depth camera sees what stands or hangs between the floor and the top of the head, such as a table's board. A cell is
free if a laser's ray passed through it and the camera saw nothing there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from pepper_sim.navigation.scans import Scan, transform
from telepresence.geometry import Pose

RESOLUTION = 0.05
"""Side of a cell [m]."""
MAX_CELLS = 1600
"""Cells per side at most: 80 m."""
OCCUPIED, FREE = 0.85, -0.40
"""What one ray adds to the log odds of the cell where it ends, and of those that it passed."""
LIMIT = 4.0
"""Log odds stay within plus and minus this, so that what has changed is unlearnt."""
CERTAIN = 0.6
"""Log odds from which on a cell counts as occupied; below minus these it counts as free."""

_GAPS = np.ones((5, 5), np.uint8)  # gaps of up to 20 cm
_BLOCK = 40  # the grid grows by this many cells on each side
_STEP = 0.5 * RESOLUTION  # distance between the points of a ray at which cells are marked as free
_SHORTENED = 1.2 * RESOLUTION  # a ray marks nothing as free so close before its end


@dataclass
class Field:
    """Distances to the nearest occupied cell, for matching scans.

    Args:
        distances: Shape (n, n) [m].
        origin: Centre of the cell (0, 0), x and y [m].
    """

    distances: np.ndarray
    origin: tuple[float, float]

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the distances at points (..., 2), interpolated; the largest one outside of the grid."""
        scaled = (points - self.origin) / RESOLUTION
        flat = scaled.reshape(-1, 2).astype(np.float32)
        columns = np.ascontiguousarray(flat[:, 1])[None, :]
        rows = np.ascontiguousarray(flat[:, 0])[None, :]
        # remap takes at most 32767 points per row.
        parts = [
            cv2.remap(
                self.distances,
                columns[:, i : i + 32000],
                rows[:, i : i + 32000],
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_CONSTANT,
                borderValue=1.0,
            )
            for i in range(0, len(flat), 32000)
        ]
        return np.concatenate(parts, axis=1).reshape(points.shape[:-1])


class OccupancyGrid:
    """A square grid that grows with what is seen. Cells are indexed [ix, iy], x and y rising."""

    def __init__(self, half_side: float = 2.0, centre: tuple[float, float] = (0.0, 0.0)) -> None:
        """`half_side`: the first grid reaches so far from its centre [m]."""
        cells = 2 * max(1, math.ceil(half_side / RESOLUTION)) + 1
        self.lasers: np.ndarray = np.zeros((cells, cells), np.float32)
        self.depth: np.ndarray = np.zeros((cells, cells), np.float32)
        first = -(cells // 2) * RESOLUTION
        self.origin = (centre[0] + first, centre[1] + first)
        self._field: Field | None = None

    @classmethod
    def restore(cls, lasers: np.ndarray, depth: np.ndarray, origin: tuple[float, float]) -> OccupancyGrid:
        """Return a grid from its layers.

        Raises:
            ValueError: They are not two square layers of one size.
        """
        if lasers.ndim != 2 or lasers.shape != depth.shape or lasers.shape[0] != lasers.shape[1]:
            raise ValueError(f"a map needs two square layers of one size, got {lasers.shape} and {depth.shape}")
        if not (np.isfinite(lasers).all() and np.isfinite(depth).all() and np.isfinite(origin).all()):
            raise ValueError("a map must hold finite numbers")
        grid = cls()
        grid.lasers, grid.depth = lasers.astype(np.float32), depth.astype(np.float32)
        grid.origin = (float(origin[0]), float(origin[1]))
        return grid

    @property
    def cells(self) -> int:
        """Cells per side."""
        return len(self.lasers)

    # --- what was seen -----------------------------------------------------------------------------------------------

    def add_scan(self, scan: Scan, pose: Pose) -> None:
        """Mark what the lasers saw from `pose` in the grid's frame."""
        ends, starts = transform(pose, scan.points), transform(pose, scan.origins)
        self._cover(ends)
        self._mark(self.lasers, ends[scan.hit], OCCUPIED, self._passed(starts, ends))

    def add_depth(self, obstacles: np.ndarray) -> None:
        """Mark where the depth camera saw something above the floor: points in the grid's frame, shape (n, 2) [m]."""
        self._cover(obstacles)
        self._mark(self.depth, obstacles, OCCUPIED, np.zeros((0, 2), np.int64))

    def _mark(self, layer: np.ndarray, hits: np.ndarray, weight: float, passed: np.ndarray) -> None:
        touched = np.zeros(layer.shape, np.float32)
        touched[passed[:, 0], passed[:, 1]] = FREE
        ends = self.cells_of(hits)
        touched[ends[:, 0], ends[:, 1]] = weight
        np.clip(layer + touched, -LIMIT, LIMIT, out=layer)
        self._field = None

    def _passed(self, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the indices of the cells that rays passed through."""
        along = ends - starts
        lengths = np.hypot(along[:, 0], along[:, 1])
        reach = np.maximum(lengths - _SHORTENED, 0.0)
        fractions = np.arange(0.0, max(float(reach.max(initial=0.0)), _STEP), _STEP)
        steps = np.minimum(fractions[None, :], reach[:, None]) / np.maximum(lengths, 1e-6)[:, None]
        points = starts[:, None, :] + steps[:, :, None] * along[:, None, :]
        return self.cells_of(points.reshape(-1, 2))

    # --- what is known -----------------------------------------------------------------------------------------------

    def occupied(self) -> np.ndarray:
        """Return which cells are occupied, shape (n, n)."""
        return (self.lasers >= CERTAIN) | (self.depth >= CERTAIN)

    def free(self) -> np.ndarray:
        """Return which cells are known to be free, shape (n, n)."""
        return (self.lasers <= -CERTAIN) & (self.depth < CERTAIN)

    def field(self) -> Field:
        """Return the distances to what the lasers saw.

        Rays are 4 degrees apart, so a wall is a row of dots at first. Here the gaps are closed: between the dots a scan
        would be pulled along the wall, back to where it was seen before.
        """
        if self._field is None:
            walls = cv2.morphologyEx((self.lasers >= CERTAIN).astype(np.uint8), cv2.MORPH_CLOSE, _GAPS)
            distances = cv2.distanceTransform(1 - walls, cv2.DIST_L2, 5) * np.float32(RESOLUTION)
            self._field = Field(np.minimum(distances, np.float32(1.0)), self.origin)
        return self._field

    def likelihoods(self) -> np.ndarray:
        """Return for each cell from 0, occupied, to 100, free; 50 where nothing is known. Shape (n, n)."""
        odds = np.where(self.depth >= CERTAIN, np.maximum(self.depth, self.lasers), self.lasers)
        return 100.0 / (1.0 + np.exp(odds))

    def index(self, x: float, y: float) -> tuple[int, int]:
        """Return the indices of the cell at a place [m]; they may be outside of the grid."""
        return round((x - self.origin[0]) / RESOLUTION), round((y - self.origin[1]) / RESOLUTION)

    def place(self, ix: float, iy: float) -> tuple[float, float]:
        """Return where the centre of a cell is [m]."""
        return self.origin[0] + ix * RESOLUTION, self.origin[1] + iy * RESOLUTION

    def places(self, indices: np.ndarray) -> np.ndarray:
        """Return where the centres of cells (n, 2) are, shape (n, 2) [m]."""
        return indices * RESOLUTION + np.array(self.origin)

    def cells_of(self, points: np.ndarray) -> np.ndarray:
        """Return the indices of the cells that hold points (n, 2) [m], without those outside of the grid."""
        return self._inside(self._indices(points))

    def _indices(self, points: np.ndarray) -> np.ndarray:
        return np.rint((points - self.origin) / RESOLUTION).astype(np.int64).reshape(-1, 2)

    def _inside(self, indices: np.ndarray) -> np.ndarray:
        return indices[((indices >= 0) & (indices < self.cells)).all(axis=1)]

    def _cover(self, points: np.ndarray) -> None:
        """Grow until all points are inside, or the grid is as large as it may be."""
        if not len(points):
            return
        indices = self._indices(points)
        beyond = max(int(-indices.min()), int(indices.max()) - self.cells + 1)
        if beyond <= 0:
            return
        added = min(_BLOCK * math.ceil(beyond / _BLOCK), (MAX_CELLS - self.cells) // 2)
        if added <= 0:
            return
        self.lasers, self.depth = np.pad(self.lasers, added), np.pad(self.depth, added)
        self.origin = (self.origin[0] - added * RESOLUTION, self.origin[1] - added * RESOLUTION)
        self._field = None
