"""The contacts between Pepper's base and its charging station."""

from __future__ import annotations

import math

import mujoco

from pepper_sim.models.charging_station import BODY
from telepresence.geometry import yaw_of

NEAR, STRAIGHT = 0.06, math.radians(12.0)
"""The contacts meet when the base is so near its place [m, rad]."""


class ChargingContacts:
    """The contacts of one robot's station; they never meet in a world without one."""

    def __init__(self, model: mujoco.MjModel, prefix: str) -> None:
        self._station = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + BODY)

    def closed(self, data: mujoco.MjData, base: slice) -> bool:
        """Whether the base stands on the contacts, as a connection would show the robot.

        Args:
            base: Where its pose is in `data.qpos`: x, y, z [m] and a quaternion.
        """
        if self._station < 0:
            return False
        x, y, _, *quaternion = data.qpos[base].tolist()
        place, rotation = data.xpos[self._station], data.xmat[self._station].reshape(3, 3)
        yaw = yaw_of(*quaternion) - math.atan2(rotation[1, 0], rotation[0, 0])
        near = math.hypot(x - place[0], y - place[1]) < NEAR
        return bool(near and abs(math.remainder(yaw, math.tau)) < STRAIGHT)
