"""Points and vectors in the plane as arrays of shape (n, 2)."""

from __future__ import annotations

import math

import numpy as np


def left_of(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, 2) turned by 90 degrees to the left."""
    return vectors[:, ::-1] * (-1.0, 1.0)


def squared_lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the squared lengths (n,) of vectors (n, 2)."""
    return np.einsum("ij,ij->i", vectors, vectors)


def squared_distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the squared distances (n, m) between points a (n, 2) and b (m, 2)."""
    return squared_lengths(a)[:, None] + squared_lengths(b) - 2.0 * (a @ b.T)


def from_base(points: np.ndarray, x: float, y: float, theta: float) -> np.ndarray:
    """Transform points of a frame that has the pose (x, y [m], theta [rad]) into the outer frame."""
    c, s = math.cos(theta), math.sin(theta)
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def into_base(points: np.ndarray, x: float, y: float, theta: float) -> np.ndarray:
    """Transform points of the outer frame into the frame that has the pose (x, y [m], theta [rad])."""
    c, s = math.cos(theta), math.sin(theta)
    return (points - (x, y)) @ np.array([[c, -s], [s, c]])
