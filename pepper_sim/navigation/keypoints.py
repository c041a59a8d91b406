"""Keypoints: recognizable points of a picture, and by how much two pictures that share some are turned."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

MOST = 300
"""Keypoints of a picture."""
AGREEING = math.radians(1.0)
"""Matches whose deviations differ by less than this belong together [rad]."""
LEAST_MATCHES, LEAST_SHARE = 4, 0.5
"""A deviation means something from these numbers on (NAOqi 2.8 documentation, ALVisualCompass)."""
_FARTHEST = 48  # of 256 bits in which the descriptors of a match may differ


@dataclass(frozen=True)
class Keypoints:
    """Keypoints of one picture.

    Args:
        points: The detector's own objects: place, size, angle, response and octave.
        angles: Direction of each from the camera's axis, to the left and up, shape (n, 2) [rad].
        descriptors: Shape (n, 32) uint8.
    """

    points: tuple[cv2.KeyPoint, ...]
    angles: np.ndarray
    descriptors: np.ndarray


@dataclass(frozen=True)
class Deviation:
    """How the second picture is turned against the first.

    Args:
        up, left: [rad]
        share: Of the matches that agree on both, 0 to 1.
        matches: Pairs of indices and the distance of their descriptors.
        inliers_up, inliers_left: Indices of the matches that agree.
    """

    up: float
    left: float
    share: float
    matches: tuple[tuple[int, int, float], ...]
    inliers_up: tuple[int, ...]
    inliers_left: tuple[int, ...]

    @property
    def sure(self) -> bool:
        """Whether enough matches agree."""
        return len(self.matches) > LEAST_MATCHES and self.share > LEAST_SHARE


def find_keypoints(pixels: np.ndarray, focal: float) -> Keypoints:
    """Return the keypoints of a picture `(height, width, 3) uint8, RGB`; `focal` in px."""
    grey = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
    points, descriptors = cv2.ORB_create(MOST, nlevels=3).detectAndCompute(grey, None)  # type: ignore[attr-defined]
    if descriptors is None:
        return Keypoints((), np.zeros((0, 2)), np.zeros((0, 32), np.uint8))
    height, width = grey.shape
    places = np.array([point.pt for point in points])
    left = np.arctan(((width - 1) / 2 - places[:, 0]) / focal)
    up = np.arctan(((height - 1) / 2 - places[:, 1]) / focal)
    return Keypoints(tuple(points), np.stack([left, up], axis=1), descriptors)


def deviation(before: Keypoints, after: Keypoints) -> Deviation:
    """Return by how much the camera has turned from one picture to the other; without matches, by nothing."""
    found = []
    if len(before.descriptors) and len(after.descriptors):
        matcher = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True)
        found = [
            (match.queryIdx, match.trainIdx, float(match.distance))
            for match in matcher.match(before.descriptors, after.descriptors)
            if match.distance <= _FARTHEST
        ]
    if not found:
        return Deviation(0.0, 0.0, 0.0, (), (), ())
    pairs = np.array([(first, second) for first, second, _ in found])
    turned = before.angles[pairs[:, 0]] - after.angles[pairs[:, 1]]
    left, inliers_left = _agreement(turned[:, 0])
    up, inliers_up = _agreement(turned[:, 1])
    share = len(set(inliers_left) & set(inliers_up)) / len(found)
    return Deviation(up, left, share, tuple(found), inliers_up, inliers_left)


def _agreement(values: np.ndarray) -> tuple[float, tuple[int, ...]]:
    """Return the value on which most agree, and who does."""
    agreeing = np.abs(values[:, None] - values[None, :]) < AGREEING
    best = agreeing[agreeing.sum(axis=1).argmax()]
    return float(values[best].mean()), tuple(np.flatnonzero(best).tolist())
