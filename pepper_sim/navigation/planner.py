"""Planner: ways over the floor that keep clear of everything known, and places from which more can be seen.

It plans on every second cell, by Dijkstra's algorithm, with a price on passing close to obstacles.
"""

from __future__ import annotations

import heapq
import math

import cv2
import numpy as np

from pepper_sim.navigation.grid import RESOLUTION, OccupancyGrid

CLEARANCE = 0.33
"""The robot's centre stays so far from obstacles [m]: 0.26 m of body and the distance at which the base refuses."""
COMFORT = 0.6
"""Nearer than this [m] the way is longer than it is: up to three times."""
VIEW = 1.6
"""Distance from which a place is looked at [m]."""
FRONTIER_CELLS = 8
"""Fewer cells than these next to the unknown are not worth a look: 40 cm."""

_STRIDE = 2
_CELL = _STRIDE * RESOLUTION
_OWN_PLACE = 0.35  # where the robot stands it may start from, whatever the map says [m]
_NEIGHBOURS = tuple(
    (dx, dy, math.hypot(dx, dy) * _CELL) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if (dx, dy) != (0, 0)
)
_SPECKLES = np.ones((5, 5), np.uint8)

Place = tuple[float, float]


class Planner:
    """Ways in one map from where the robot stands.

    Args:
        grid: The map.
        start: The robot's place in it [m].
        seen: Obstacles that the map does not hold, in its frame, shape (n, 2) [m].
        beyond: Whether the way may lead through what is unknown.
    """

    def __init__(
        self, grid: OccupancyGrid, start: Place, seen: np.ndarray | None = None, *, beyond: bool = False
    ) -> None:
        self._grid = grid
        occupied = grid.occupied()
        free = grid.free()
        if seen is not None and len(seen):
            occupied = occupied.copy()
            cells = grid.cells_of(seen)
            occupied[cells[:, 0], cells[:, 1]] = True
        # Single cells between rays that no ray has passed are taken for what is around them.
        known = cv2.morphologyEx(free.astype(np.uint8), cv2.MORPH_CLOSE, _SPECKLES).astype(bool) & ~occupied
        self._unknown = ~known & ~occupied
        gaps = cv2.distanceTransform((~occupied).astype(np.uint8), cv2.DIST_L2, 5) * RESOLUTION
        self._open = (gaps >= CLEARANCE) & (known | beyond)
        x, y = np.meshgrid(_axis(grid, 0), _axis(grid, 1), indexing="ij")
        self._open |= (np.hypot(x - start[0], y - start[1]) <= _OWN_PLACE) & ~occupied
        self._known = known
        self._price = 1.0 + 2.0 * np.clip((COMFORT - gaps) / (COMFORT - CLEARANCE), 0.0, 1.0)
        self._start = self._coarse(start)
        self._costs, self._before = self._spread()

    def way_to(self, goal: Place, tolerance: float = 0.15) -> list[Place] | None:
        """Return the corners of the way to `goal`, the last one within `tolerance` [m] of it; None if there is none."""
        cell = self._nearest(goal, tolerance)
        if cell is None:
            return None
        way = self._straightened(self._trace(cell))
        exact = math.dist(self._place(cell), goal) < _CELL and self._is_open(goal)
        return [*way[:-1], goal] if exact else way

    def nearest_reachable(self, goal: Place) -> Place | None:
        """Return the place nearest to `goal` that can be reached; None if the robot cannot move at all."""
        cell = self._nearest(goal, math.inf)
        return None if cell is None else self._place(cell)

    def next_view(self, centre: Place, radius: float, seen: list[Place]) -> Place | None:
        """Return the place to go to in order to see more; None if there is nothing left to see.

        Args:
            centre, radius: It lies in this circle [m].
            seen: Places that were looked at already without seeing more: nothing within half a metre of them.
        """
        border = self._known & (cv2.dilate(self._unknown.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)
        count, labels, stats, centres = cv2.connectedComponentsWithStats(border.astype(np.uint8), connectivity=8)
        reached = np.argwhere(np.isfinite(self._costs))
        if not len(reached):
            return None
        places = self._grid.places(reached * _STRIDE)
        allowed = np.hypot(places[:, 0] - centre[0], places[:, 1] - centre[1]) <= radius
        for place in seen:
            allowed &= np.hypot(places[:, 0] - place[0], places[:, 1] - place[1]) > 0.5
        places, costs = places[allowed], self._costs[reached[allowed, 0], reached[allowed, 1]]
        best, best_value = None, math.inf
        for label in range(1, count):
            cells = int(stats[label, cv2.CC_STAT_AREA])
            if cells < FRONTIER_CELLS or not len(places):
                continue
            # connectedComponents counts columns first: its x is our second index.
            members = np.argwhere(labels == label)
            middle = members[np.abs(members - centres[label][::-1]).sum(axis=1).argmin()]
            target = self._grid.place(float(middle[0]), float(middle[1]))
            near = np.hypot(places[:, 0] - target[0], places[:, 1] - target[1]) <= VIEW
            if not near.any():
                continue
            value = costs[near] - 0.02 * cells
            index = int(value.argmin())
            if value[index] < best_value:
                best_value, best = float(value[index]), tuple(places[near][index].tolist())
        return best

    # --- inside ------------------------------------------------------------------------------------------------------

    def _spread(self) -> tuple[np.ndarray, np.ndarray]:
        """Return for each coarse cell the cost of the way there, and from which cell it comes."""
        open_cells = self._open[::_STRIDE, ::_STRIDE]
        price = self._price[::_STRIDE, ::_STRIDE].tolist()
        passable = open_cells.tolist()
        rows, columns = open_cells.shape
        costs = [[math.inf] * columns for _ in range(rows)]
        before = np.full((rows, columns, 2), -1, np.int32)
        i, j = self._start
        if not (0 <= i < rows and 0 <= j < columns and passable[i][j]):
            return np.array(costs), before
        costs[i][j] = 0.0
        heap = [(0.0, i, j)]
        while heap:
            cost, i, j = heapq.heappop(heap)
            if cost > costs[i][j]:
                continue
            for di, dj, length in _NEIGHBOURS:
                k, m = i + di, j + dj
                if 0 <= k < rows and 0 <= m < columns and passable[k][m]:
                    total = cost + length * price[k][m]
                    if total < costs[k][m]:
                        costs[k][m] = total
                        before[k, m] = i, j
                        heapq.heappush(heap, (total, k, m))
        return np.array(costs), before

    def _nearest(self, goal: Place, tolerance: float) -> tuple[int, int] | None:
        reached = np.argwhere(np.isfinite(self._costs))
        if not len(reached):
            return None
        places = self._grid.places(reached * _STRIDE)
        gaps = np.hypot(places[:, 0] - goal[0], places[:, 1] - goal[1])
        nearest = int(gaps.argmin())
        if gaps[nearest] > tolerance:
            return None
        return int(reached[nearest, 0]), int(reached[nearest, 1])

    def _trace(self, cell: tuple[int, int]) -> list[Place]:
        cells = [cell]
        while cells[-1] != self._start:
            i, j = self._before[cells[-1]].tolist()
            cells.append((i, j))
        return [self._place(cell) for cell in reversed(cells)]

    def _straightened(self, way: list[Place]) -> list[Place]:
        """Return the corners of a way: from each place on as straight as the open floor allows."""
        corners, i = [way[0]], 0
        while i < len(way) - 1:
            j = len(way) - 1
            while j > i + 1 and not self._clear(way[i], way[j]):
                j -= 1
            corners.append(way[j])
            i = j
        return corners[1:] or [way[0]]

    def _clear(self, a: Place, b: Place) -> bool:
        steps = max(1, math.ceil(math.dist(a, b) / RESOLUTION))
        between = np.linspace(a, b, steps + 1)
        return all(self._is_open((x, y)) for x, y in between.tolist())

    def _is_open(self, place: Place) -> bool:
        ix, iy = self._grid.index(*place)
        return 0 <= ix < self._grid.cells and 0 <= iy < self._grid.cells and bool(self._open[ix, iy])

    def _coarse(self, place: Place) -> tuple[int, int]:
        ix, iy = self._grid.index(*place)
        return round(ix / _STRIDE), round(iy / _STRIDE)

    def _place(self, cell: tuple[int, int]) -> Place:
        return self._grid.place(cell[0] * _STRIDE, cell[1] * _STRIDE)


def _axis(grid: OccupancyGrid, axis: int) -> np.ndarray:
    """Return the centres of the cells along an axis [m]."""
    return grid.origin[axis] + np.arange(grid.cells) * RESOLUTION
