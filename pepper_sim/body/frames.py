"""Poses of Pepper's links and sensors by their URDF names."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

ROOT = "base_footprint"


class Frames:
    """Finds the links of one robot. Methods that take `data` need the world's lock."""

    def __init__(self, model: mujoco.MjModel, prefix: str) -> None:
        self._bodies = _names(model.body, model.nbody, prefix)
        self._sites = _names(model.site, model.nsite, prefix)

    def find(self, data: mujoco.MjData, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return rotation (3, 3) and position (3,) [m] of a link in the world, as views of `data`.

        Raises:
            ValueError: There is no such link.
        """
        if name in self._bodies:
            body = self._bodies[name]
            return data.xmat[body].reshape(3, 3), data.xpos[body]
        if name in self._sites:
            site = self._sites[name]
            return data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
        known = sorted({*self._bodies, *self._sites})
        raise ValueError(f"Pepper has no link {name!r}; links: {', '.join(known)}")

    def center_of_mass(self, model: mujoco.MjModel, data: mujoco.MjData, names: Sequence[str]) -> tuple[float, Any]:
        """Return mass [kg] and centre of mass (3,) [m] in the frame of the base, of some links together.

        Raises:
            ValueError: One of them is no link with a mass.
        """
        bodies = [self._bodies[name] for name in names if name in self._bodies]
        masses = model.body_mass[bodies]
        if len(bodies) != len(names) or not masses.sum():
            raise ValueError(f"no link of Pepper with a mass: {', '.join(names)}")
        rotation, position = self.find(data, ROOT)
        return float(masses.sum()), (masses @ data.xipos[bodies] / masses.sum() - position) @ rotation

    def in_odometry(self, data: mujoco.MjData, name: str, odometry: tuple[float, float, float]) -> np.ndarray:
        """Return the pose (4, 4) of a link in the odometry frame.

        Height, roll and pitch are the true ones; position and heading of the base come from `odometry` (x, y, theta).
        """
        base = _homogeneous(*self.find(data, ROOT))
        pose = _homogeneous(*self.find(data, name))
        x, y, theta = odometry
        heading = math.atan2(base[1, 0], base[0, 0])
        c, s = math.cos(theta - heading), math.sin(theta - heading)
        pose[:2, 3] -= base[:2, 3]
        return np.array([[c, -s, 0.0, x], [s, c, 0.0, y], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]) @ pose


def roll_pitch_yaw(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return the angles of R = Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    (xx, _, _), (yx, _, _), (zx, zy, zz) = rotation.tolist()
    return math.atan2(zy, zz), math.asin(max(-1.0, min(1.0, -zx))), math.atan2(yx, xx)


def _names(access: Callable[[int], Any], count: int, prefix: str) -> dict[str, int]:
    names = ((access(i).name, i) for i in range(count))
    return {name.removeprefix(prefix): i for name, i in names if name.startswith(prefix)}


def _homogeneous(rotation: np.ndarray, position: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = position
    return pose
