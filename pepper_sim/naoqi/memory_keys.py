"""ALMemory's keys of the robot's body: how each is read from a snapshot.

Source of names, types and units: NAOqi 2.8 documentation, pepper_dcm actuator and sensor names; robot information keys
as ros-naoqi/naoqi_driver reads them. Values are computed when they are read.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pepper_sim.body.description import (
    BATTERY_VOLTAGE,
    LASER_ANGLES,
    LASER_MISS,
    LASER_PERIOD,
    SHOVEL_ANGLES,
    WHEEL_RADIUS,
    WHEELS,
)
from pepper_sim.body.power import DRIVE_POWER, ELECTRONICS_RISE, ROOM
from pepper_sim.naoqi.identity import IDENTITY_KEYS

Reader = Callable[[Any], Any]
"""A robot's snapshot -> the key's value."""

_DEVICE = "Device/SubDeviceList/"
_LASER = _DEVICE + "Platform/LaserSensor/"
_AXES = "XYZ"
_SIDES = ("Front", "Left", "Right")
_HORIZONTAL_SEGMENTS = range(1, len(LASER_ANGLES) + 1)
_SHOVEL_SEGMENTS = range(1, len(SHOVEL_ANGLES) + 1)

TOUCH_SENSORS: dict[str, tuple[str, str]] = {
    "FrontTactil": ("Head/Touch/Front", "FrontTactilTouched"),
    "MiddleTactil": ("Head/Touch/Middle", "MiddleTactilTouched"),
    "RearTactil": ("Head/Touch/Rear", "RearTactilTouched"),
    "HandRightBack": ("RHand/Touch/Back", "HandRightBackTouched"),
    "HandLeftBack": ("LHand/Touch/Back", "HandLeftBackTouched"),
    "ChestButton": ("ChestBoard/Button", "ChestButtonPressed"),
}
"""Touch sensor of `pepper_sim.body.sensors` -> (device, event)."""

BUMPERS: dict[str, tuple[str, str, str]] = {
    "FrontRight": ("Platform/FrontRight/Bumper", "RightBumperPressed", "Platform/FrontRight/Bumper"),
    "FrontLeft": ("Platform/FrontLeft/Bumper", "LeftBumperPressed", "Platform/FrontLeft/Bumper"),
    "Back": ("Platform/Back/Bumper", "BackBumperPressed", "Platform/Back/Bumper"),
}
"""Bumper of `pepper_sim.body.sensors` -> (device, event, name in TouchChanged)."""


def body_keys(joints: tuple[str, ...]) -> dict[str, Reader]:
    """Return every key of the robot's body and how to read it.

    Args:
        joints: Joint names in the order of the group "Body".
    """
    keys: dict[str, Reader] = {"DCM/Time": lambda s: int(s.time * 1000) & 0x7FFFFFFF}
    for joint in joints:
        keys.update(_joint(joint))
    for wheel in WHEELS:
        keys.update(_wheel(wheel))
    keys.update(_inertial("InertialSensorBase", "imu_base"))
    keys.update(_inertial("InertialSensor", "imu_torso"))
    keys.update(_lasers())
    keys.update(_doubtful_laser_points())
    keys.update(_laser_registers())
    for side in ("Left", "Right"):
        keys[f"{_DEVICE}Platform/InfraredSpot/{side}/Sensor/Value"] = _entry("infrared", side)
    for side in ("Front", "Back"):
        keys[f"{_DEVICE}Platform/{side}/Sonar/Sensor/Value"] = _entry("sonar", side)
    for name, (device, _) in TOUCH_SENSORS.items():
        keys[f"{_DEVICE}{device}/Sensor/Value"] = _entry("touch", name)
    for name, (device, _, _) in BUMPERS.items():
        keys[f"{_DEVICE}{device}/Sensor/Value"] = _entry("bumpers", name)
    keys.update(_battery())
    keys[f"{_DEVICE}Platform/ILS/Sensor/Value"] = _constant(0.0)  # the power hatch is closed
    keys.update({key: _constant(text) for key, text in IDENTITY_KEYS.items()})
    return keys


def _entry(field: str, name: str) -> Reader:
    """Read the number that the snapshot's map `field` holds under `name`."""
    return lambda s: float(getattr(s, field)[name])


def _constant(value: Any) -> Reader:
    return lambda s: value


def _joint(joint: str) -> dict[str, Reader]:
    base = _DEVICE + joint

    def actuator(s: Any) -> float:
        values = s.joint_setpoints if s.stiffness[joint] > 0.0 else s.joint_positions
        return float(values[joint])

    return {
        f"{base}/Position/Sensor/Value": lambda s: float(s.joint_positions[joint]),
        f"{base}/Position/Actuator/Value": actuator,
        f"{base}/Hardness/Actuator/Value": lambda s: float(s.stiffness[joint]),
        f"{base}/Temperature/Sensor/Value": lambda s: float(s.temperatures[joint]),
        f"{base}/Temperature/Sensor/Status": _constant(0),
        f"{base}/ElectricCurrent/Sensor/Value": lambda s: motor_current(joint, s.joint_torques[joint]),
        f"Motion/Velocity/Sensor/{joint}": lambda s: float(s.joint_velocities[joint]),
        f"Motion/Torque/Sensor/{joint}": lambda s: float(s.joint_torques[joint]),
        f"Motion/Position/Sensor/{joint}": lambda s: float(s.joint_positions[joint]),
        f"Motion/Command/Position/{joint}": actuator,
    }


CELLS = 7
"""Lithium-ion cells in series: 26.46 V nominal (NAOqi 2.8 documentation, battery_pep) are seven of 3.78 V."""

_NO_LOAD_SPEED: tuple[tuple[str, float], ...] = (
    ("Wrist", 16.0),
    ("Hand", 22.0),
    ("HeadPitch", 7.5),
    ("ShoulderRoll", 7.5),
    ("ElbowRoll", 7.5),
    ("HipRoll", 4.57),
    ("", 5.91),
)
"""Part of a joint's name -> speed of the joint without load at nominal voltage [rad/s] (NAOqi 2.8, page motors_pep)."""


def motor_current(joint: str, torque: float) -> float:
    """Return the absolute motor current [A] for a torque at the joint [N m].

    The motor is an ideal DC motor: torque per ampere is voltage divided by no-load speed; friction is left out.
    """
    speed = next(speed for part, speed in _NO_LOAD_SPEED if part in joint)
    return float(abs(torque) * speed / BATTERY_VOLTAGE)


def _wheel(wheel: str) -> dict[str, Reader]:
    base = f"{_DEVICE}Wheel{wheel}"
    power_per_speed = (
        DRIVE_POWER * WHEEL_RADIUS / len(WHEELS)
    )  # of one wheel [W s/rad]: the simulated battery pays as much
    return {
        f"{base}/Speed/Sensor/Value": lambda s: float(s.wheel_speeds[wheel]),
        f"{base}/Speed/Actuator/Value": lambda s: float(s.wheel_speeds[wheel]),
        f"{base}/Stiffness/Actuator/Value": lambda s: 1.0 if s.stiffness["KneePitch"] > 0.0 else 0.0,
        f"{base}/ElectricCurrent/Sensor/Value": (
            lambda s: float(abs(s.wheel_speeds[wheel]) * power_per_speed / BATTERY_VOLTAGE)
        ),
        f"{base}/Temperature/Sensor/Value": _constant(ROOM + ELECTRONICS_RISE),
        f"{base}/Temperature/Sensor/Status": _constant(0),
    }


def _battery() -> dict[str, Reader]:
    """Keys of the battery. Charge and current are simulated; voltages are nominal, temperatures those of the room."""
    base = f"{_DEVICE}Battery"
    cells = {f"{base}/Voltage{cell}/Sensor/Value": BATTERY_VOLTAGE / CELLS for cell in range(1, CELLS + 1)}
    constants = {
        **cells,
        f"{base}/Voltage{CELLS + 1}/Sensor/Value": 0.0,  # the board has room for one more cell
        f"{base}/Charge/Sensor/TotalVoltage": BATTERY_VOLTAGE,
        **{f"{base}/Temperature{place}/Sensor/Value": ROOM for place in ("", "Sensor1", "Sensor2", "Sensor3")},
    }
    return {
        f"{base}/Charge/Sensor/Value": lambda s: float(s.battery.charge),
        f"{base}/Current/Sensor/Value": lambda s: float(s.battery.current),
        **{key: _constant(value) for key, value in constants.items()},
    }


def _inertial(device: str, field: str) -> dict[str, Reader]:
    keys: dict[str, Reader] = {}
    for index, axis in enumerate(_AXES):
        for name, source in (("Gyroscope", "gyro"), ("Accelerometer", "accel"), ("Angle", "angles")):
            keys[f"{_DEVICE}{device}/{name}{axis}/Sensor/Value"] = _imu_axis(field, source, index)
    return keys


def _imu_axis(field: str, source: str, index: int) -> Reader:
    return lambda s: float(getattr(getattr(s, field), source)[index])


def _lasers() -> dict[str, Reader]:
    """Points where the laser planes hit, on the ground, in a frame under each camera: x ahead of it, y left [m]."""
    keys: dict[str, Reader] = {}
    for axis_index, axis in enumerate("XY"):
        for side in _SIDES:
            for segment in _HORIZONTAL_SEGMENTS:
                keys[f"{_LASER}{side}/Horizontal/Seg{segment:02d}/{axis}/Sensor/Value"] = _laser_point(
                    side, segment - 1, axis_index
                )
        for segment in _SHOVEL_SEGMENTS:
            keys[f"{_LASER}Front/Shovel/Seg{segment:02d}/{axis}/Sensor/Value"] = _shovel_point(segment - 1, axis_index)
        for side in ("Left", "Right"):
            keys[f"{_LASER}Front/Vertical/{side}/Seg01/{axis}/Sensor/Value"] = _vertical_point(side, axis_index)
    return keys


def _laser_point(side: str, row: int, axis: int) -> Reader:
    return lambda s: float(s.laser[side][row, axis])


def _shovel_point(row: int, axis: int) -> Reader:
    return lambda s: float(s.shovel[row, axis])


def _vertical_point(side: str, axis: int) -> Reader:
    return lambda s: float(s.vertical[side][axis])


def _doubtful_laser_points() -> dict[str, Reader]:
    """Points that the lasers are unsure of, or take for reflections: x ahead, y left, per horizontal segment [m].

    A simulated ray either hits something or not, and nothing reflects it. So there are no such points, and these keys
    read as every empty segment does: the far point.
    """
    keys: dict[str, Reader] = {}
    for segment, angle in zip(_HORIZONTAL_SEGMENTS, LASER_ANGLES, strict=True):
        for axis, far in (("X", LASER_MISS * math.cos(angle)), ("Y", LASER_MISS * math.sin(angle))):
            for side in _SIDES:
                for kind in ("UncertainObstacle", "AnnoyingReflection"):
                    keys[f"{_LASER}{side}/{kind}/Seg{segment:02d}/{axis}/Sensor/Value"] = _constant(far)
    return keys


def _laser_registers() -> dict[str, Reader]:
    """Registers of the three laser boards.

    OperationMode is the sum of 1 horizontal, 2 verticals and 4 shovel: every laser a board has is always on. FrameCount
    counts readings and wraps at 65535, BoardTemp is that of all simulated electronics [°C]. Status, AssertFailCount,
    RunMode and CalibrDataVer are not simulated: they are zero, like registers that nobody has written.
    """
    keys: dict[str, Reader] = {}
    for side in _SIDES:
        base = f"{_LASER}{side}/Reg/"
        mode = 7.0 if side == "Front" else 1.0
        for part in ("Sensor", "Actuator"):
            keys[f"{base}OperationMode/{part}/Value"] = _constant(mode)
        keys[f"{base}FrameCount/Sensor/Value"] = lambda s: float(int(s.time / LASER_PERIOD) % 65536)
        keys[f"{base}BoardTemp/Sensor/Value"] = _constant(ROOM + ELECTRONICS_RISE)
        for name in ("Status", "AssertFailCount", "RunMode", "CalibrDataVer"):
            keys[f"{base}{name}/Sensor/Value"] = _constant(0.0)
    return keys
