"""Targets: values as a Pepper's services return them, once libqi has unpacked them; any of them may be anything."""

from __future__ import annotations

from typing import Any

from fuzz_harness import Target
from fuzz_values import Values, packed


class _Reply:
    def __init__(self, value: Any) -> None:
        self._value = value

    def result(self, _timeout: float) -> Any:
        return self._value


class _Connection:
    """A robot that answers every question with the next value."""

    def __init__(self, values: Values, data: list[Any]) -> None:
        self._values, self._data = values, data

    def call(self, *_: object, **__: object) -> Any:
        return ["HeadYaw", "HeadPitch", "WheelB"]

    def call_async(self, _service: str, method: str, *_: object) -> _Reply:
        if method == "getListData":
            return _Reply(self._data)
        count = 6 if method == "getPosition" else 3
        return _Reply(self._values.values(count) if self._values.byte() < 200 else self._values.value())


def naoqi_body() -> Target:
    """Joints, wheels, inertial sensors, torso, odometry."""
    from naoqi_driver.body import BodyReader
    from naoqi_driver.connection import RobotError

    count = 4 * 2 + 3 + 2 * 9

    def feed(data: bytes) -> None:
        values = Values(data)
        BodyReader(_Connection(values, values.values(count))).read()  # type: ignore[arg-type]

    tail = b"".join(b"\0" + packed(*[0.1] * size) for size in (6, 3, 3))
    return Target(feed, (packed(*[0.5] * count) + tail,), (RobotError, ValueError), 2000)


def naoqi_sensors() -> Target:
    """Laser lines, sonars, bumpers, touch, battery, temperatures, what the robot is."""
    from naoqi_driver.condition import (
        BATTERY_KEYS,
        INFO_KEYS,
        SWITCHES,
        read_battery,
        read_info,
        read_switches,
        read_temperatures,
        temperature_keys,
    )
    from naoqi_driver.connection import RobotError
    from naoqi_driver.range_sensors import KEYS, Reader
    from pepper_sensors import laser, sonar

    joints = ("HeadYaw", "HeadPitch")
    reader = Reader()
    stamp = 0.0

    def feed(data: bytes) -> None:
        nonlocal stamp
        stamp += 0.05
        values = Values(data)
        read_battery(values.values(len(BATTERY_KEYS)))
        read_switches(values.values(len(SWITCHES)))
        read_info(values.values(len(INFO_KEYS)))
        read_temperatures(joints, values.values(len(temperature_keys(joints))))
        sonar.to_range(values.value())
        reader.read(values.values(len(KEYS)), values.values(3), stamp)
        laser.read_points(values.values(len(laser.KEYS)))

    read_once = len(BATTERY_KEYS) + len(SWITCHES) + len(INFO_KEYS) + len(temperature_keys(joints))
    count = read_once + 1 + len(KEYS) + 3 + len(laser.KEYS)
    return Target(feed, (packed(*[0.5] * count),), (RobotError, ValueError), 6000)


def naoqi_picture() -> Target:
    """Replies of the cameras: twelve values, among them the pixels."""
    from naoqi_driver.connection import RobotError
    from pepper_sensors.camera import read_reply

    def feed(data: bytes) -> None:
        values = Values(data)
        if values.byte() < 128:
            size = (values.byte() % 20, values.byte() % 20, 3, 11)
            pixels = bytes(size[0] * size[1] * 3)
            read_reply([*size, *values.values(2), pixels, 0, *values.values(4)])
        else:
            read_reply(values.values(values.byte() % 16))

    seed = bytes((0, 4, 3)) + 2 * (b"\x40" + (7).to_bytes(8, "little")) + packed(0.5, 0.4, -0.5, -0.4)
    return Target(feed, (seed,), (RobotError, ValueError), 600)
