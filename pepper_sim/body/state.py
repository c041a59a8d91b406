"""What Pepper's sensors read at one instant: frozen values that belong to their reader. SI units, no NAOqi words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Imu:
    """An inertial sensor in the axes of its body (x forward, y left, z up).

    Args:
        gyro: Turning rates [rad/s], within ±500 °/s.
        accel: Specific force [m/s²], within ±2 g: gravity included, so (0, 0, +9.81) at rest on level ground.
        angles: Roll, pitch, yaw [rad], R = Rz Ry Rx; yaw counts from the start.
    """

    gyro: Vector
    accel: Vector
    angles: Vector


@dataclass(frozen=True)
class Battery:
    """Battery: `charge` 0...1, `current` [A], negative while it discharges; whether a charger is connected."""

    charge: float
    current: float
    plugged: bool = False


@dataclass(frozen=True)
class MoveFailure:
    """The last motion of the base that was refused or stopped by the robot itself.

    Args:
        count: How many there have been since the start; it changes with every new one.
        cause: "obstacle", "stiffness", "fallen" or "charging" (on its station); empty before the first.
        started: False if the motion was refused, True if it was stopped on the way.
        obstacle: The obstacle in the odometry frame (x, y, z) [m]; zeros if there is none.
    """

    count: int = 0
    cause: str = ""
    started: bool = False
    obstacle: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Snapshot:
    """All of Pepper's sensors after one tick.

    Args:
        time: Simulation time [s]; it never runs backwards.
        stamp: Wall-clock time [s since 1970].
        joint_positions: Measured angles [rad], encoder steps of 1.5 mrad; hands 0 closed ... 1 open.
        joint_setpoints: Setpoints of the servos [rad]; of a limp joint, its measured angle.
        joint_velocities: [rad/s]
        joint_torques: Torque of the motors, gravity compensation included [N m].
        stiffness: 0 limp ... 1 full torque.
        odometry: Pose by the wheels (x, y, theta) [m, m, rad] since the last reset.
        next_odometry: Odometry one motion cycle ahead.
        velocity: Velocity by the wheels (vx, vy, wz) in base_footprint [m/s, m/s, rad/s].
        wheel_speeds: "FL", "FR", "B" [rad/s], positive about the wheel axis of the URDF.
        imu_base, imu_torso: Inertial sensors.
        sonar: "Front", "Back" [m], SONAR_MIN ... SONAR_MAX.
        laser: "Front", "Left", "Right": (15, 2) float, x and y [m] in the ground frame under the device's camera,
            Seg01 (leftmost) first; a point LASER_MISS away where nothing is within LASER_MAX.
        laser_odometry: `odometry` at the instant at which the lasers were read.
        shovel: (3, 2) float, x and y [m] in the frame of the front laser: where the sloping light meets a surface.
        vertical: "Left", "Right": (2,) float, as shovel, one point each.
        infrared: "Left", "Right": something is nearer than INFRARED_RANGE, 45 degrees to that side of straight ahead.
        bumpers: "FrontLeft", "FrontRight", "Back".
        touch: "FrontTactil", "MiddleTactil", "RearTactil", "HandRightBack", "HandLeftBack", "ChestButton".
        temperatures: Motor temperature per joint [°C].
        moving: The base is driving or has a motion to finish.
        move_failed: The last motion that the robot refused or stopped on its own.
        fallen: The robot lies on the floor; its joints are limp until the world is reset.
    """

    time: float
    stamp: float
    joint_positions: Mapping[str, float]
    joint_setpoints: Mapping[str, float]
    joint_velocities: Mapping[str, float]
    joint_torques: Mapping[str, float]
    stiffness: Mapping[str, float]
    odometry: Vector
    next_odometry: Vector
    velocity: Vector
    wheel_speeds: Mapping[str, float]
    imu_base: Imu
    imu_torso: Imu
    sonar: Mapping[str, float]
    laser: Mapping[str, np.ndarray]
    laser_odometry: Vector
    shovel: np.ndarray
    vertical: Mapping[str, np.ndarray]
    infrared: Mapping[str, bool]
    bumpers: Mapping[str, bool]
    touch: Mapping[str, bool]
    battery: Battery
    temperatures: Mapping[str, float]
    moving: bool
    move_failed: MoveFailure
    fallen: bool
