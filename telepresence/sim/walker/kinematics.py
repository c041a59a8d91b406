"""The legs' geometry: joint angles <-> feet. All four legs at once; frame: trunk, x forward, y left, z up.

A leg has three joints: `out` turns it about the trunk's x axis, `hip` and `knee` bend it about y. Knees point backward.
"""

from __future__ import annotations

import numpy as np

LEGS = ("front_left", "front_right", "rear_left", "rear_right")
JOINTS = ("out", "hip", "knee")
SIDE = np.array([1.0, -1.0, 1.0, -1.0])
"""Left legs 1, right legs -1."""
HIPS = np.array([[0.145, 0.055, 0.0], [0.145, -0.055, 0.0], [-0.145, 0.055, 0.0], [-0.145, -0.055, 0.0]])
"""Where the legs are fixed to the trunk [m]."""
OFFSET = 0.045
"""Distance from the axis of `out` sideways to the plane in which a leg bends [m]."""
THIGH, SHANK = 0.115, 0.115
"""Hip to knee, knee to the middle of the foot [m]."""
FOOT_RADIUS = 0.020
"""[m]"""
_SHORTEST, _LONGEST = 0.07, 0.226
"""Reach of a leg that is neither folded into itself nor stretched [m]."""


def joint_angles(feet: np.ndarray) -> np.ndarray:
    """Return the joint angles for feet at these positions; feet out of reach are moved within reach.

    Args:
        feet: Middles of the feet in the trunk's frame, shape (4, 3) [m].
    Returns:
        `out`, `hip`, `knee` of each leg, shape (4, 3) [rad].
    """
    x, y, z = (feet - HIPS).T
    side = OFFSET * SIDE
    down = np.sqrt(np.maximum(y * y + z * z - OFFSET * OFFSET, 1e-6))
    out = np.arctan2(y, -z) - np.arctan2(side, down)
    reach = np.clip(np.hypot(x, down), _SHORTEST, _LONGEST)
    inside = np.arccos((THIGH**2 + SHANK**2 - reach**2) / (2.0 * THIGH * SHANK))
    above = np.arccos((THIGH**2 + reach**2 - SHANK**2) / (2.0 * THIGH * reach))
    return np.stack([out, np.arctan2(-x, down) + above, inside - np.pi], axis=1)


def feet_at(angles: np.ndarray) -> np.ndarray:
    """Return the middles of the feet in the trunk's frame (4, 3) [m] for joint angles (4, 3) [rad]."""
    out, hip, knee = angles.T
    x = -THIGH * np.sin(hip) - SHANK * np.sin(hip + knee)
    down = THIGH * np.cos(hip) + SHANK * np.cos(hip + knee)
    side = OFFSET * SIDE
    c, s = np.cos(out), np.sin(out)
    return HIPS + np.stack([x, side * c + down * s, side * s - down * c], axis=1)
