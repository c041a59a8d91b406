"""Depth pictures: what belongs together, the top of it, and how large it really is."""

from __future__ import annotations

import math

import cv2
import numpy as np

from pepper_sim.naoqi.vision.pictures import Picture

SAME = 0.05
"""Neighbouring pixels whose depths differ by less belong to one object [m]."""


def segments(metres: np.ndarray, threshold: float = SAME) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut a depth picture where neighbours differ.

    Args:
        metres: (height, width) float32, 0 where nothing is seen.
        threshold: Largest difference within a segment [m].
    Returns:
        Labels of all pixels, 0 for none; and for each label x, y, width, height, pixels and the centre [px].
    """
    inside = metres > 0.0
    inside[:, 1:] &= np.abs(np.diff(metres, axis=1)) <= threshold
    inside[1:, :] &= np.abs(np.diff(metres, axis=0)) <= threshold
    _, labels, boxes, centres = cv2.connectedComponentsWithStats(inside.astype(np.uint8), connectivity=4)
    return labels, boxes, centres


def top_above(metres: np.ndarray, x: float, y: float, threshold: float = SAME) -> tuple[int, int]:
    """Return the highest pixel that is reached from (x, y) straight up without a jump in depth."""
    column, row = round(x), round(y)
    while row > 0 and metres[row - 1, column] > 0.0 and abs(metres[row - 1, column] - metres[row, column]) <= threshold:
        row -= 1
    return column, row


def real_size(picture: Picture, width: float, height: float, distance: float) -> list[float]:
    """Return width and height [m] of so many pixels at a distance [m]."""
    rows, columns = picture.pixels.shape[:2]
    across, down = (2.0 * distance * math.tan(angle / 2.0) for angle in (picture.camera.fovx, picture.camera.fovy))
    return [width / columns * across, height / rows * down]
