"""Inertial sensors of base and torso, from velocities of the simulated body.

Ranges: NAOqi 2.8 documentation, inertial_pep: about 500 °/s and about 2 g. Beyond, a sensor shows the end of its range.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from pepper_sim.body.frames import Frames, roll_pitch_yaw
from pepper_sim.body.state import Imu
from telepresence.sim.world import TICK

GYRO_NOISE, ACCEL_NOISE = 0.003, 0.03
"""Standard deviations [rad/s, m/s²]."""
GYRO_RANGE = math.radians(500.0)
"""A gyrometer shows at most this much either way [rad/s]."""
ACCEL_RANGE = 2.0 * 9.80665
"""An accelerometer shows at most this much either way [m/s²], gravity included."""
PLACES = {"base": "base_footprint", "torso": "torso"}
"""Sensor -> link whose axes it uses."""


class InertialSensors:
    """Reads gyrometers directly; computes specific force from the change of velocity over two ticks.

    The physics engine's own accelerometer shows single steps, in which the drive servo's reaction to a new setpoint is
    several times the average; a real sensor is slower than that.
    """

    def __init__(self, model: mujoco.MjModel, prefix: str, frames: Frames, rng: np.random.Generator) -> None:
        self._frames = frames
        self._rng = rng
        self._gravity = model.opt.gravity
        self._gyros = {place: _three(model, f"{prefix}imu_{place}_gyro") for place in PLACES}
        first, second = (_three(model, f"{prefix}imu_{place}_velocity") for place in PLACES)
        if first.stop != second.start:
            raise ValueError(f"{prefix}: the velocity sensors of base and torso must follow each other")
        self._velocities = slice(first.start, second.stop)
        self._history = [np.zeros((2, 3))] * 3
        self._yaw_at_start = 0.0

    def reset(self, data: mujoco.MjData) -> None:
        """Count yaw from here; `data` must have its kinematics computed."""
        self._history = [np.zeros((2, 3))] * 3
        self._yaw_at_start = roll_pitch_yaw(self._frames.find(data, PLACES["base"])[0])[2]

    def tick(self, data: mujoco.MjData) -> None:
        """Remember this tick's velocities."""
        self._history = [*self._history[1:], data.sensordata[self._velocities].reshape(2, 3).copy()]

    def read(self, data: mujoco.MjData) -> dict[str, Imu]:
        """Return the readings of "base" and "torso", noise included."""
        forces = (self._history[2] - self._history[0]) / (2.0 * TICK) - self._gravity
        noise = self._rng.standard_normal((2, 2, 3))
        readings = {}
        for index, (place, link) in enumerate(PLACES.items()):
            rotation = self._frames.find(data, link)[0]
            gyro = data.sensordata[self._gyros[place]] + GYRO_NOISE * noise[index, 0]
            accel = forces[index] @ rotation + ACCEL_NOISE * noise[index, 1]
            gyro, accel = gyro.clip(-GYRO_RANGE, GYRO_RANGE), accel.clip(-ACCEL_RANGE, ACCEL_RANGE)
            roll, pitch, yaw = roll_pitch_yaw(rotation)
            yaw = math.remainder(yaw - self._yaw_at_start, math.tau)
            readings[place] = Imu(tuple(gyro.tolist()), tuple(accel.tolist()), (roll, pitch, yaw))
        return readings


def _three(model: mujoco.MjModel, sensor: str) -> slice:
    address = int(model.sensor(sensor).adr[0])
    return slice(address, address + 3)
