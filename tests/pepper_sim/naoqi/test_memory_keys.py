"""The keys of the body: all there, of the documented types, and with true values."""

import math

import pytest

from pepper_sim.naoqi.memory_keys import motor_current

D = "Device/SubDeviceList/"
JOINTS = (
    "HeadYaw HeadPitch LShoulderPitch LShoulderRoll LElbowYaw LElbowRoll LWristYaw LHand HipRoll HipPitch KneePitch "
    "RShoulderPitch RShoulderRoll RElbowYaw RElbowRoll RWristYaw RHand"
).split()
LASER = D + "Platform/LaserSensor/"

IMU_AXES = ("GyroscopeZ", "AccelerometerX")

FLOATS = [
    *(f"{D}{j}/Position/{k}/Value" for j in JOINTS for k in ("Sensor", "Actuator")),
    *(
        f"{D}{j}/{k}/Value"
        for j in JOINTS
        for k in ("ElectricCurrent/Sensor", "Temperature/Sensor", "Hardness/Actuator")
    ),
    *(f"Motion/{k}/Sensor/{j}" for j in JOINTS for k in ("Velocity", "Torque")),
    *(f"{D}Wheel{w}/Speed/{k}/Value" for w in ("FL", "FR", "B") for k in ("Sensor", "Actuator")),
    *(f"{D}Platform/{s}/Sonar/Sensor/Value" for s in ("Front", "Back")),
    *(
        f"{LASER}{s}/Horizontal/Seg{n:02d}/{a}/Sensor/Value"
        for s in ("Front", "Left", "Right")
        for n in range(1, 16)
        for a in "XY"
    ),
    *(f"{LASER}Front/Shovel/Seg{n:02d}/{a}/Sensor/Value" for n in range(1, 4) for a in "XY"),
    *(f"{LASER}Front/Vertical/{s}/Seg01/{a}/Sensor/Value" for s in ("Left", "Right") for a in "XY"),
    *(f"{D}Platform/{s}/Bumper/Sensor/Value" for s in ("FrontLeft", "FrontRight", "Back")),
    *(f"{D}Head/Touch/{s}/Sensor/Value" for s in ("Front", "Middle", "Rear")),
    *(f"{D}{s}/Touch/Back/Sensor/Value" for s in ("LHand", "RHand")),
    f"{D}ChestBoard/Button/Sensor/Value",
    *(
        f"{D}{i}/{q}{a}/Sensor/Value"
        for i in ("InertialSensorBase", "InertialSensor")
        for q in ("Gyroscope", "Accelerometer", "Angle")
        for a in "XYZ"
    ),
    *(f"{D}Wheel{w}/{k}/Sensor/Value" for w in ("FL", "FR", "B") for k in ("ElectricCurrent", "Temperature")),
    *(f"{D}Battery/{k}/Sensor/Value" for k in ("Temperature", "TemperatureSensor3", "Voltage1", "Voltage8")),
    f"{D}Battery/Charge/Sensor/Value",
    f"{D}Battery/Current/Sensor/Value",
    f"{D}Platform/ILS/Sensor/Value",
    f"{D}Face/Led/Red/Left/0Deg/Actuator/Value",
    f"{D}Ears/Led/Right/324Deg/Actuator/Value",
    f"{D}ChestBoard/Led/Blue/Actuator/Value",
]
STRINGS = ["RobotConfig/Head/FullHeadId", "Device/DeviceList/ChestBoard/BodyId", "RobotConfig/Body/Type"]


def test_every_documented_float_is_there_in_one_call(naoqi):
    values = naoqi.ALMemory.getListData(FLOATS)
    wrong = [key for key, value in zip(FLOATS, values, strict=True) if not isinstance(value, float)]
    assert not wrong
    assert len(FLOATS) > 250


def test_strings_and_integers(naoqi):
    memory = naoqi.ALMemory
    assert all(isinstance(value, str) and value for value in memory.getListData(STRINGS))
    assert memory.getData("RobotConfig/Body/Type") == "Juliette"
    first = memory.getData("DCM/Time")
    assert isinstance(first, int)
    assert memory.getData(f"{D}HeadYaw/Temperature/Sensor/Status") == 0


def test_resting_sensors_tell_the_truth(naoqi, wait_until):
    memory = naoqi.ALMemory
    gravity = f"{D}InertialSensorBase/AccelerometerZ/Sensor/Value"
    wait_until(lambda: memory.getData(gravity) == pytest.approx(9.81, abs=0.2), "the robot stands still")
    assert memory.getData(f"{D}HeadPitch/Position/Sensor/Value") == pytest.approx(-0.2117, abs=0.03)
    assert memory.getData(f"{D}KneePitch/Hardness/Actuator/Value") == 1.0
    assert 0.0 < memory.getData(f"{D}Battery/Charge/Sensor/Value") <= 1.0


def test_inertial_sensors_end_at_500_degrees_per_second_and_2_g(naoqi, simulation, wait_until):
    axes = [f"{D}InertialSensor{place}/{sensor}/Sensor/Value" for place in ("Base", "") for sensor in IMU_AXES]
    robot, extremes = naoqi.robot, [0.0] * len(axes)
    with robot.world.locked() as data:
        push = data.body(f"{robot.prefix}base_footprint").xfrc_applied
        push[:] = 3000.0, 0.0, 0.0, 0.0, 0.0, 600.0  # [N, N m], until the restart

    def reach_the_ends() -> bool:
        values = naoqi.ALMemory.getListData(axes)
        extremes[:] = [max(abs(value), seen) for value, seen in zip(values, extremes, strict=True)]
        return extremes[0] > 8.7 and extremes[1] > 19.6

    try:
        wait_until(reach_the_ends, "it spins and is thrown")
    finally:
        simulation.restart()
    rate, acceleration, torso_rate, torso_acceleration = extremes
    assert rate == pytest.approx(math.radians(500.0), rel=1e-6) and torso_rate <= rate
    assert acceleration == pytest.approx(2 * 9.80665, rel=1e-6) and torso_acceleration <= acceleration


def test_joints_move_in_the_steps_of_their_hall_encoders(naoqi):
    step = math.tau / 4096  # 12 bits
    keys = [f"{D}{joint}/Position/Sensor/Value" for joint in JOINTS]
    naoqi.ALMotion.setAngles("HeadYaw", 0.5, 0.1)
    for _ in range(20):
        angles = naoqi.ALMemory.getListData(keys)
        steps = [angle / step for angle in angles]
        assert steps == pytest.approx([round(count) for count in steps], abs=1e-4)  # float32


def test_wheels_turn_when_the_robot_drives(naoqi, wait_until):
    naoqi.ALMotion.move(0.2, 0.0, 0.0)
    keys = [f"{D}Wheel{w}/Speed/Sensor/Value" for w in ("FL", "FR", "B")]
    wait_until(lambda: naoqi.ALMemory.getData(keys[0]) > 1.0, "the left wheel turns")
    left, right, back = naoqi.ALMemory.getListData(keys)
    assert left > 1.0 and right == pytest.approx(-left, rel=0.05) and abs(back) < 0.1
    naoqi.ALMotion.stopMove()


def test_the_actuator_of_a_limp_joint_shows_where_it_is(naoqi, wait_until):
    memory, motion = naoqi.ALMemory, naoqi.ALMotion
    motion.setStiffnesses("LArm", 0.0)
    keys = [f"{D}LShoulderPitch/Position/{k}/Value" for k in ("Actuator", "Sensor")]
    wait_until(lambda: abs(memory.getData(keys[1]) - 1.58) > 0.02, "the arm falls")
    actuator, sensor = memory.getListData(keys)
    assert actuator == sensor
    motion.setStiffnesses("LArm", 1.0)


def test_motor_current_follows_from_the_motor():
    # A motor that needs 26.46 V for 5.91 rad/s gives 4.48 N m per ampere at the joint.
    assert motor_current("KneePitch", -13.9) == pytest.approx(13.9 * 5.91 / 26.46)
    assert motor_current("LHand", 0.0) == 0.0
