"""Rotations as MuJoCo has them: quaternions, scalar first."""

from __future__ import annotations

import mujoco
import numpy as np


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
