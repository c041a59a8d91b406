from __future__ import annotations

import math

import pytest
from naoqi_driver.base import relative_pose
from naoqi_driver.body import WHEELS, BodyReader, as_number, quaternion
from naoqi_driver.connection import Address, Connection

from telepresence.geometry import Pose

JOINTS = ["HeadYaw", "HeadPitch", "LHand"]
DEVICE = "Device/SubDeviceList"


class Motion:
    def getBodyNames(self, name: str) -> list[str]:
        assert name == "Body"
        return [*JOINTS, *WHEELS]  # some robots name their wheels here

    def getPosition(self, name: str, frame: int, sensors: bool) -> list[float]:
        assert (name, frame, sensors) == ("Torso", 1, True)
        return [1.0, 2.0, 0.82, 0.01, 0.02, 0.5]

    def getRobotPosition(self, sensors: bool) -> list[float]:
        return [1.0, 2.0, 0.5]

    def getRobotVelocity(self) -> list[float]:
        return [0.2, 0.0, -0.1]


class Memory:
    def __init__(self) -> None:
        self.values = {
            f"{DEVICE}/HeadYaw/Position/Sensor/Value": 0.1,
            f"{DEVICE}/HeadPitch/Position/Sensor/Value": -0.2,
            f"{DEVICE}/LHand/Position/Sensor/Value": 0.6,
            f"{DEVICE}/HeadYaw/Position/Actuator/Value": 0.15,
            "Motion/Velocity/Sensor/HeadYaw": 0.3,
            f"{DEVICE}/HeadYaw/Hardness/Actuator/Value": 1.0,
            f"{DEVICE}/WheelB/Speed/Sensor/Value": 2.0,
            f"{DEVICE}/InertialSensor/AccelerometerZ/Sensor/Value": 9.81,
            f"{DEVICE}/InertialSensorBase/AccelerometerZ/Sensor/Value": 9.79,
        }
        self.calls = 0

    def getListData(self, keys: list[str]) -> list:
        self.calls += 1
        return [self.values.get(key) for key in keys]


@pytest.fixture
def memory(naoqi) -> Memory:
    service = Memory()
    naoqi.register("ALMotion", Motion())
    naoqi.register("ALMemory", service)
    return service


@pytest.fixture
def link(naoqi, memory):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as connection:
        assert connection.wait_connected(10)
        yield connection


def test_one_call_of_the_memory_reads_every_key(link, memory):
    reader = BodyReader(link)
    state = reader.read()
    assert memory.calls == 1
    assert reader.joints == tuple(JOINTS)
    assert state.positions == [0.1, -0.2, 0.6]
    assert state.velocities[0] == 0.3
    assert state.stiffness[0] == 1.0
    assert state.wheel_speeds[WHEELS.index("WheelB")] == 2.0
    assert (state.imu.acceleration[2], state.imu_base.acceleration[2]) == (9.81, 9.79)
    assert state.torso.z == 0.82
    assert state.floor == (1.0, 2.0, 0.5)
    assert state.velocity == (0.2, 0.0, -0.1)


def test_keys_that_the_robot_does_not_have_are_nan(link):
    state = BodyReader(link).read()
    assert math.isnan(state.velocities[1])
    assert math.isnan(state.imu.angles[0])


def test_commanded_angles_on_request(link):
    assert BodyReader(link, use_joint_sensors=False).read().positions[0] == 0.15


@pytest.mark.parametrize(("value", "expected"), [(1, 1.0), (2.5, 2.5), (True, 1.0)])
def test_numbers_of_the_memory(value, expected):
    assert as_number(value) == expected


@pytest.mark.parametrize("value", [None, "text", [1.0]])
def test_what_is_no_number_is_nan(value):
    assert math.isnan(as_number(value))


def test_quaternion_turns_as_the_angles_do():
    # Rz(90) Ry(0) Rx(90) takes x to y and y to z.
    x, y, z, w = quaternion(math.pi / 2, 0.0, math.pi / 2)
    assert (x, y, z, w) == pytest.approx((0.5, 0.5, 0.5, 0.5))
    assert quaternion(0, 0, 0) == (0, 0, 0, 1)


def test_relative_pose_is_what_the_robot_sees():
    # The robot at (1, 1) looks along y; (1, 3) is 2 m ahead, and looking along -x is a quarter turn to the left.
    assert relative_pose(Pose(1, 3, math.pi), Pose(1, 1, math.pi / 2)) == pytest.approx((2, 0, math.pi / 2))
    assert relative_pose(Pose(0, 0, -3), Pose(0, 0, 3)).theta == pytest.approx(2 * math.pi - 6)
