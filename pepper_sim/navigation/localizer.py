"""Localizer: where the robot is in a map, from the wheels and the lasers.

The wheels say how far the robot went; their error grows with the way. Each scan is laid over the map at many poses
around the one that the wheels promise, and the poses weighted by how well its points meet what the map holds: their
mean is the robot's pose, their spread how sure it is. (Correlative scan matching, as Olson describes it, ICRA 2009.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pepper_sim.navigation.grid import Field, OccupancyGrid
from pepper_sim.navigation.scans import Scan, compose, relative, transform
from telepresence.geometry import Pose, wrap_angle

DRIFT_XY, DRIFT_THETA = 0.03, 0.03
"""Error that is expected of the wheels: metres per metre and radians per radian."""
POINT_ERROR = 0.06
"""Standard deviation of a scan's point from the obstacle that it belongs to, with cells of 5 cm [m]."""
LOST = 0.12
"""A standard deviation of the position beyond which the robot no longer knows where it is [m]."""
MATCHED = 0.1
"""A point so close to an obstacle of the map agrees with it [m]."""
AGREEMENT = 0.7
"""Share of the points that must agree for a pose that was searched for without a guess."""

_ORIGIN = Pose(0.0, 0.0, 0.0)
_LEAST_POINTS = 10
_WEIGHT = 0.35  # points of one scan share their errors: they count for less than independent ones
_FINEST = (0.004, 0.004, 0.003)  # standard deviations never shrink below these [m, m, rad]
_OFFSETS = np.linspace(-2.2, 2.2, 7)  # of the tried poses, in standard deviations
_COARSE_STEP, _COARSE_ANGLES = 0.1, 72  # of the search in the whole map [m], directions
_BEST = 40  # coarse candidates that are looked at closely
_MAX_TRIED = 400_000
_GUESS_ERROR = 0.5  # of a guess [m]


@dataclass(frozen=True)
class Estimate:
    """A pose in the map and the standard deviations of x, y and theta [m, m, rad]."""

    pose: Pose
    deviations: tuple[float, float, float]


class Localizer:
    """Follows the robot through a map. While the map is being made, `map_too` adds each scan to it."""

    def __init__(self, grid: OccupancyGrid, start: Pose = _ORIGIN) -> None:
        """`start`: where the robot stands in the map."""
        self.grid = grid
        self.pose = start
        self._deviations = np.array(_FINEST)
        self._odometry: Pose | None = None

    @property
    def estimate(self) -> Estimate:
        x, y, theta = self._deviations.tolist()
        return Estimate(self.pose, (x, y, theta))

    @property
    def lost(self) -> bool:
        """Whether the position has become too uncertain to drive by it."""
        return bool(self._deviations[:2].max() > LOST)

    def place(self, pose: Pose, deviations: tuple[float, float, float] = _FINEST) -> None:
        """Say where the robot stands; what the wheels did before no longer matters."""
        self.pose = pose
        self._deviations = np.maximum(deviations, _FINEST)
        self._odometry = None

    def at(self, odometry: Pose) -> Pose:
        """Return the pose in the map for a pose by the wheels, newer than the last scan."""
        return self.pose if self._odometry is None else compose(self.pose, relative(self._odometry, odometry))

    def add(self, scan: Scan, *, map_too: bool = False) -> None:
        """Correct the pose by a new scan; with `map_too` the scan becomes part of the map."""
        self._predict(scan.odometry)
        self._correct(scan)
        if map_too:
            self.grid.add_scan(scan, self.pose)

    def _predict(self, odometry: Pose) -> None:
        if self._odometry is not None:
            moved = relative(self._odometry, odometry)
            distance, turned = math.hypot(moved.x, moved.y), abs(moved.theta)
            if distance > 1.0:  # nobody drives so far between two scans: the robot was carried, or its world restarted
                self._deviations = np.array((1.0, 1.0, 1.0))
            self.pose = compose(self.pose, moved)
            added = DRIFT_XY * distance + self._deviations[2] * distance
            self._deviations += (added, added, DRIFT_THETA * turned)
        self._odometry = odometry

    def _correct(self, scan: Scan) -> None:
        points = scan.obstacles
        field = self.grid.field()
        if len(points) < _LEAST_POINTS:
            return
        distances = field.at(transform(self.pose, points))
        # The others see what the map does not hold yet, such as the next piece of a wall.
        known = distances < MATCHED + 2.0 * self._deviations[:2].max()
        if known.sum() < _LEAST_POINTS:
            return
        spread = self._deviations
        tried, offsets = _around(self.pose, spread)
        scores = -0.5 * _WEIGHT * _mismatch(field, tried, points[known]) - 0.5 * (offsets**2).sum(axis=1)
        weights = np.exp(scores - scores.max())
        weights /= weights.sum()
        shift = weights @ (offsets * spread)
        variances = weights @ (offsets * spread - shift) ** 2
        x, y, theta = shift.tolist()
        self.pose = Pose(self.pose.x + x, self.pose.y + y, wrap_angle(self.pose.theta + theta))
        self._deviations = np.maximum(np.minimum(np.sqrt(variances), spread), _FINEST)

    # --- searching ---------------------------------------------------------------------------------------------------

    def search(self, points: np.ndarray, guess: Pose | None = None, reach: float = 1.0) -> float:
        """Find the robot again from what it sees, anywhere in the map or around a guess.

        Args:
            points: Obstacles in base_footprint, shape (n, 2) [m]; more than one scan's make it surer.
            guess: Where it may be; a heading that is not finite is unknown.
            reach: How far from the guess [m].
        Returns:
            Share of the points that agree with the map there, 0 to 1; the pose is taken over if enough of them do.
        """
        if len(points) < _LEAST_POINTS:
            return 0.0
        points = points[:: max(1, len(points) // 90)]
        field = self.grid.field()
        tried = self._candidates(guess, reach)
        if not len(tried):
            return 0.0
        few = points[:: max(1, len(points) // 30)]
        parts = np.array_split(tried, math.ceil(len(tried) / 4000))
        scores = np.concatenate([_mismatch(field, part, few) + _doubt(part, guess, len(few)) for part in parts])
        best = tried[np.argsort(scores)[:_BEST]]
        spread = np.array((_COARSE_STEP, _COARSE_STEP, math.tau / _COARSE_ANGLES)) / 2
        for _ in range(3):
            close = np.concatenate([_around(Pose(*pose), spread)[0] for pose in best])
            fine = _mismatch(field, close, points) + _doubt(close, guess, len(points))
            best = close[np.argsort(fine)[:4]]
            spread = spread / 3
        pose = Pose(*best[0].tolist())
        agreement = float((field.at(transform(pose, points)) < MATCHED).mean())
        if agreement >= AGREEMENT:
            self.place(Pose(pose.x, pose.y, wrap_angle(pose.theta)), (0.03, 0.03, 0.02))
        return agreement

    def _candidates(self, guess: Pose | None, reach: float) -> np.ndarray:
        """Return the poses to try, shape (n, 3): free places of the map in all directions."""
        step = max(1, round(_COARSE_STEP / 0.05))
        places = self.grid.places(np.argwhere(self.grid.free()[::step, ::step]) * step)
        angles = np.arange(_COARSE_ANGLES) * math.tau / _COARSE_ANGLES - math.pi
        if guess is not None:
            places = places[np.hypot(places[:, 0] - guess.x, places[:, 1] - guess.y) <= reach]
            places = np.concatenate([places, [(guess.x, guess.y)]])
            if math.isfinite(guess.theta):
                near = np.abs(np.angle(np.exp(1j * (angles - guess.theta)))) <= math.pi / 4
                angles = np.append(angles[near], guess.theta)
        places = places[:: max(1, math.ceil(len(places) * len(angles) / _MAX_TRIED))]
        return np.column_stack([np.repeat(places, len(angles), axis=0), np.tile(angles, len(places))])


def _around(pose: Pose, spread: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return poses around `pose`, shape (343, 3), and their offsets in standard deviations."""
    offsets = np.stack(np.meshgrid(_OFFSETS, _OFFSETS, _OFFSETS, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.array(pose) + offsets * spread, offsets


def _doubt(poses: np.ndarray, guess: Pose | None, points: int) -> np.ndarray | float:
    """Return how much poses far from a guess count as worse: where the map looks the same, the guess decides."""
    if guess is None:
        return 0.0
    away = np.hypot(poses[:, 0] - guess.x, poses[:, 1] - guess.y) / _GUESS_ERROR
    return 0.3 * points * away**2


def _mismatch(field: Field, poses: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how badly `points` in the robot's frame meet the map at each pose: squared errors, those of strays cut."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    placed = np.empty((len(poses), len(points), 2))
    placed[..., 0] = poses[:, :1] + c[:, None] * points[:, 0] - s[:, None] * points[:, 1]
    placed[..., 1] = poses[:, 1:2] + s[:, None] * points[:, 0] + c[:, None] * points[:, 1]
    errors = field.at(placed) / POINT_ERROR
    return np.minimum(errors**2, 9.0).sum(axis=1)
