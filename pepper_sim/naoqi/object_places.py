"""Places of ALWorldRepresentation's objects, [x, y, z, wx, wy, wz] in metres and radians, and the matrices they are.

The angles are those of R = Rz(wz) Ry(wy) Rx(wx).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from pepper_sim.body.frames import roll_pitch_yaw
from pepper_sim.naoqi.service import ServiceError, finite, shown
from telepresence.sim.rotation import rotation_of

PLACES = 6
"""Numbers of a place."""


def as_transform(place: Sequence[float]) -> np.ndarray:
    """Return a place as a matrix (4, 4).

    Raises: ServiceError: It is none.
    """
    if len(place) != PLACES:
        raise ServiceError(f"position6D must be [x, y, z, wx, wy, wz], got {shown(place)}")
    numbers = [finite(value, "position6D") for value in place]
    turn = np.zeros(4)
    mujoco.mju_euler2Quat(turn, np.array(numbers[3:]), "XYZ")
    transform = np.eye(4)
    transform[:3, :3] = rotation_of(turn)
    transform[:3, 3] = numbers[:3]
    return transform


def as_place(transform: np.ndarray) -> list[float]:
    """Return a matrix as a place."""
    return [float(value) for value in (*transform[:3, 3], *roll_pitch_yaw(transform[:3, :3]))]


def quaternion(rotation: np.ndarray) -> list[float]:
    """Return [w, x, y, z] of a rotation (3, 3)."""
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, rotation.flatten())
    return [float(value) for value in turn]


def at(places: Sequence[tuple[float, list[float]]], when: float) -> list[float]:
    """Return the place at a time, linearly between the known ones, before the first and after the last the nearest.

    Args:
        places: Times and places, the newest last; at least one.
    """
    earlier = [entry for entry in places if entry[0] <= when]
    later = [entry for entry in places if entry[0] > when]
    if not earlier or not later:
        return (earlier[-1] if earlier else later[0])[1]
    (start, first), (end, last) = earlier[-1], later[0]
    part = (when - start) / (end - start)
    moved = [begin + part * (goal - begin) for begin, goal in zip(first[:3], last[:3], strict=True)]
    turned = [
        begin + part * math.remainder(goal - begin, math.tau) for begin, goal in zip(first[3:], last[3:], strict=True)
    ]
    return moved + turned
