"""Connected pixels of a mask: the largest ones, and circles around them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

ROUND = 0.75
"""A blob is round from this share of its surrounding circle on."""


@dataclass(frozen=True)
class Blob:
    """Connected pixels: their surrounding circle and how many they are [px]."""

    x: float
    y: float
    radius: float
    size: float


def largest(mask: np.ndarray, least_size: float, least_roundness: float = 0.0) -> Blob | None:
    """Return the largest blob of a mask (uint8) that is large and round enough; None if there is none."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    for contour in sorted(contours, key=cv2.contourArea, reverse=True):
        size = cv2.contourArea(contour)
        if size < max(least_size, 1):
            return None
        (x, y), radius = cv2.minEnclosingCircle(contour)
        if size >= least_roundness * math.pi * radius * radius:
            return Blob(float(x), float(y), float(radius), float(size))
    return None
