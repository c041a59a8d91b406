"""Rays and contacts in a batch of places; first axis: place."""

from __future__ import annotations

import math

import numpy as np
from safety.worlds import Batch


def cast(batch: Batch, origins: np.ndarray, directions: np.ndarray, furthest: float) -> np.ndarray:
    """Distance to the first thing along each ray.

    Args:
        origins, directions: (S, B, 2), world [m], unit vectors.
        furthest: Infinity is returned beyond [m].
    Returns:
        (S, B) [m].
    """
    ox, oy = origins[..., 0, None], origins[..., 1, None]
    ux, uy = directions[..., 0, None], directions[..., 1, None]
    # Only what can be reached by some ray of its place.
    dx, dy = batch.circle[:, None, :, 0] - ox, batch.circle[:, None, :, 1] - oy
    along = dx * ux + dy * uy
    across = dx * uy - dy * ux
    half = batch.circle[:, None, :, 2] ** 2 - across * across
    hit = (half > 0.0) & (along > 0.0)
    distance = np.where(hit, along - np.sqrt(np.where(hit, half, 0.0)), math.inf).min(2)

    ax, ay = batch.segment[:, None, :, 0] - ox, batch.segment[:, None, :, 1] - oy
    ex = batch.segment[:, None, :, 2] - batch.segment[:, None, :, 0]
    ey = batch.segment[:, None, :, 3] - batch.segment[:, None, :, 1]
    turn = ux * ey - uy * ex
    turn = np.where(np.abs(turn) < 1e-12, 1e-12, turn)
    far = (ax * ey - ay * ex) / turn
    where = (ax * uy - ay * ux) / turn
    hit = (far > 0.0) & (where >= 0.0) & (where <= 1.0)
    distance = np.minimum(distance, np.where(hit, far, math.inf).min(2))
    distance = np.maximum(distance, 0.0)
    return np.where(distance > furthest, math.inf, distance)


class Hull:
    """The robot's true outline: convex polygon `corners` (k, 2) in base_link, grown by `radius` [m]."""

    def __init__(self, corners: np.ndarray, radius: float) -> None:
        self.corners = np.asarray(corners, float)
        self.radius = radius
        self.edges = np.roll(self.corners, -1, axis=0) - self.corners

    def contacts(self, batch: Batch, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gap to everything [m], with the way out.

        Args:
            pose: (S, 3).
        Returns:
            gap: (S, C + W), circles first; place: (S, C + W, 2), where on the other thing, world [m];
            inner: (S, C + W, 2), the nearest place of the inner polygon, world [m].
        """
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        rotation = np.stack([np.stack([c, s], 1), np.stack([-s, c], 1)], 1)  # row vectors: base -> world
        corners = self.corners @ rotation + pose[:, None, :2]  # (S, k, 2)
        gap_c, inner_c = self._to_points(batch.circle[..., :2], corners)
        away = batch.circle[..., :2] - inner_c
        size = np.maximum(np.sqrt((away**2).sum(2)), 1e-9)
        place_c = batch.circle[..., :2] - away / size[..., None] * batch.circle[..., 2:]
        gap_c = gap_c - batch.circle[..., 2]

        a, b = batch.segment[..., :2], batch.segment[..., 2:]
        gap, place, inner = [], [], []
        for end in (a, b):
            distance, nearest = self._to_points(end, corners)
            gap.append(distance)
            place.append(end)
            inner.append(nearest)
        edge = b - a
        length = np.maximum((edge**2).sum(2), 1e-12)
        for k in range(len(self.corners)):
            corner = corners[:, None, k]
            along = np.clip(((corner - a) * edge).sum(2) / length, 0.0, 1.0)
            foot = a + along[..., None] * edge
            gap.append(np.sqrt(((foot - corner) ** 2).sum(2)))
            place.append(foot)
            inner.append(np.broadcast_to(corner, foot.shape))
        gap = np.stack(gap)
        best = gap.argmin(0)
        gap_w = np.take_along_axis(gap, best[None], 0)[0]
        place_w = np.take_along_axis(np.stack(place), best[None, ..., None], 0)[0]
        inner_w = np.take_along_axis(np.stack(inner), best[None, ..., None], 0)[0]
        return (
            np.concatenate([gap_c, gap_w], 1) - self.radius,
            np.concatenate([place_c, place_w], 1),
            np.concatenate([inner_c, inner_w], 1),
        )

    def _to_points(self, points: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance of points (S, N, 2) from the polygon's border, negative inside, and the nearest place on it."""
        if len(self.corners) == 1:
            nearest = np.broadcast_to(corners, points.shape)
            return np.sqrt(((points - nearest) ** 2).sum(2)), nearest
        edges = np.roll(corners, -1, axis=1) - corners
        offset = points[:, :, None] - corners[:, None]
        along = np.clip((offset * edges[:, None]).sum(3) / (edges**2).sum(2)[:, None], 0.0, 1.0)
        foot = corners[:, None] + along[..., None] * edges[:, None]
        distance = np.sqrt(((points[:, :, None] - foot) ** 2).sum(3))
        best = distance.argmin(2)
        nearest = np.take_along_axis(foot, best[..., None, None], 2)[:, :, 0]
        distance = np.take_along_axis(distance, best[..., None], 2)[..., 0]
        inside = (edges[:, None, :, 0] * offset[..., 1] - edges[:, None, :, 1] * offset[..., 0] > 0.0).all(2)
        return np.where(inside, -distance, distance), nearest
