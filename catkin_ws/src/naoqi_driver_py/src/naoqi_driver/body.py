"""What the body of a NAOqi robot measures, read in one cycle.

Wire: one `ALMemory.getListData` for everything that is a key, `ALMotion.getPosition("Torso", 1 (world), True)` for the
pose of the torso [m, m, m, rad, rad, rad], `ALMotion.getRobotPosition(True)` for the place on the floor and
`ALMotion.getRobotVelocity` [m/s, m/s, rad/s], all on their way together. Keys: NAOqi 2.8 documentation,
pepper_dcm/actuator_sensor_names; a key that a robot does not have is answered with None.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from naoqi_driver.connection import Connection
from naoqi_driver.replies import as_number, names, numbers, sequence
from telepresence.geometry import Pose, Velocity

WHEELS = ("WheelFL", "WheelB", "WheelFR")
MOST_JOINTS = 100
WORLD_FRAME = 1
_AXES = ("X", "Y", "Z")
_DEVICE = "Device/SubDeviceList"


Vector = tuple[float, float, float]


class TorsoPose(NamedTuple):
    """Position [m] and roll, pitch, yaw [rad], R = Rz(yaw) Ry(pitch) Rx(roll)."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float


@dataclass(frozen=True)
class Imu:
    """Roll, pitch, yaw [rad], angular velocity [rad/s] and acceleration with gravity [m/s²]; NaN where there is no
    sensor. One is in the torso, one in the base."""

    angles: Vector
    gyro: Vector
    acceleration: Vector


@dataclass(frozen=True)
class BodyState:
    """One reading.

    Joint lists follow `BodyReader.joints`; velocities and torques are NaN where the robot has no key. `floor` is x, y,
    theta in the odometry's frame, `velocity` that of base_footprint.
    """

    positions: list[float]
    velocities: list[float]
    efforts: list[float]
    stiffness: list[float]
    wheel_speeds: list[float]
    imu: Imu
    imu_base: Imu
    torso: TorsoPose
    floor: Pose
    velocity: Velocity


class BodyReader:
    """Reads the body over a link.

    Args:
        connection: The link to the robot.
        use_joint_sensors: Measured joint angles; False gives the commanded ones.
    """

    def __init__(self, connection: Connection, use_joint_sensors: bool = True) -> None:
        self.joints: tuple[str, ...] = ()
        self._connection = connection
        self._kind = "Sensor" if use_joint_sensors else "Actuator"
        self._keys: list[str] = []

    def prepare(self) -> None:
        """Ask the robot for its joints. To be repeated after every new connection.

        Raises:
            RobotUnreachable, CallRefused: See `Connection.call`.
        """
        found = names(self._connection.call("ALMotion", "getBodyNames", "Body"), MOST_JOINTS, "getBodyNames")
        self.joints = tuple(name for name in found if name not in WHEELS)
        self._keys = (
            [f"{_DEVICE}/{joint}/Position/{self._kind}/Value" for joint in self.joints]
            + [f"Motion/Velocity/Sensor/{joint}" for joint in self.joints]
            + [f"Motion/Torque/Sensor/{joint}" for joint in self.joints]
            + [f"{_DEVICE}/{joint}/Hardness/Actuator/Value" for joint in self.joints]
            + [f"{_DEVICE}/{wheel}/Speed/Sensor/Value" for wheel in WHEELS]
            + [
                f"{_DEVICE}/{sensor}/{quantity}{axis}/Sensor/Value"
                for sensor in ("InertialSensor", "InertialSensorBase")
                for quantity in ("Angle", "Gyroscope", "Accelerometer")
                for axis in _AXES
            ]
        )

    def read(self, timeout: float = 1.0) -> BodyState:
        """Everything, as of now.

        Raises:
            RobotUnreachable, CallRefused: See `Connection.call`.
        """
        if not self._keys:
            self.prepare()
        values = self._connection.call_async("ALMemory", "getListData", self._keys)
        torso = self._connection.call_async("ALMotion", "getPosition", "Torso", WORLD_FRAME, True)
        floor = self._connection.call_async("ALMotion", "getRobotPosition", True)
        velocity = self._connection.call_async("ALMotion", "getRobotVelocity")
        measured = [as_number(value) for value in sequence(values.result(timeout), "getListData", len(self._keys))]
        count = len(self.joints)
        rest = measured[4 * count + len(WHEELS) :]
        return BodyState(
            positions=measured[:count],
            velocities=measured[count : 2 * count],
            efforts=measured[2 * count : 3 * count],
            stiffness=measured[3 * count : 4 * count],
            wheel_speeds=measured[4 * count : 4 * count + len(WHEELS)],
            imu=_imu(rest[:9]),
            imu_base=_imu(rest[9:18]),
            torso=TorsoPose(*numbers(torso.result(timeout), 6, "getPosition")),
            floor=Pose(*numbers(floor.result(timeout), 3, "getRobotPosition")),
            velocity=Velocity(*numbers(velocity.result(timeout), 3, "getRobotVelocity")),
        )


def _imu(values: Sequence[float]) -> Imu:
    return Imu(_vector(values[0:3]), _vector(values[3:6]), _vector(values[6:9]))


def _vector(values: Sequence[float]) -> Vector:
    first, second, third = values
    return first, second, third


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Unit quaternion (x, y, z, w) of the rotation Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def all_finite(values: Sequence[float]) -> bool:
    """Whether every value is a number that can be used."""
    return all(math.isfinite(value) for value in values)
