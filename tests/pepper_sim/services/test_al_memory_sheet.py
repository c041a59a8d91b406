"""Every ALMemory key that NAOqi 2.8's documentation lists for Pepper, read as a plain client would.

The keys are written down here a second time, from the documentation (page pepper_dcm/actuator_sensor_names, ALMemory's
events) and naoqi_driver, so that a key lost from the simulator is missed here.
"""

from __future__ import annotations

import math
import re
from itertools import product

import pytest

D = "Device/SubDeviceList/"
CHUNK = 100
"""Keys per call of getListData."""


def expand(pattern: str) -> list[str]:
    """All keys of a pattern: `{A,B}` is either, `{01..15}` each number, as a shell expands braces."""
    choices = []
    for part in re.split(r"{([^}]*)}", pattern)[1::2]:
        numbers = re.fullmatch(r"(\d+)\.\.(\d+)", part)
        if numbers:
            first, last = numbers.groups()
            choices.append([f"{n:0{len(first)}d}" for n in range(int(first), int(last) + 1)])
        else:
            choices.append(part.split(","))
    template = re.sub(r"{[^}]*}", "{}", pattern)
    return [template.format(*values) for values in product(*choices)]


JOINT = (
    "{HeadYaw,HeadPitch,LShoulderPitch,LShoulderRoll,LElbowYaw,LElbowRoll,LWristYaw,LHand,"
    "HipRoll,HipPitch,KneePitch,RShoulderPitch,RShoulderRoll,RElbowYaw,RElbowRoll,RWristYaw,RHand}"
)
WHEEL = "Wheel{FL,FR,B}"
LASER = D + "Platform/LaserSensor/"
SIDE = "{Front,Left,Right}"
POINT = "{X,Y}/Sensor/Value"

NUMBERS: dict[str, tuple[float, float]] = {
    f"{D}{JOINT}/Position/{{Sensor,Actuator}}/Value": (-math.pi, math.pi),
    f"{D}{JOINT}/ElectricCurrent/Sensor/Value": (0.0, 20.0),
    f"{D}{JOINT}/Temperature/Sensor/Value": (10.0, 100.0),
    f"{D}{JOINT}/Hardness/Actuator/Value": (0.0, 1.0),
    f"Motion/Velocity/Sensor/{JOINT}": (-20.0, 20.0),
    f"Motion/Torque/Sensor/{JOINT}": (-200.0, 200.0),
    f"{D}{WHEEL}/Speed/{{Actuator,Sensor}}/Value": (-20.0, 20.0),
    f"{D}{WHEEL}/ElectricCurrent/Sensor/Value": (0.0, 20.0),
    f"{D}{WHEEL}/Temperature/Sensor/Value": (10.0, 100.0),
    f"{D}{WHEEL}/Stiffness/Actuator/Value": (0.0, 1.0),
    f"{D}Platform/{{Front,Back}}/Sonar/Sensor/Value": (0.25, 5.0),
    f"{LASER}{SIDE}/Horizontal/Seg{{01..15}}/{POINT}": (-5.6, 5.6),
    f"{LASER}Front/Shovel/Seg{{01..03}}/{POINT}": (-5.7, 5.7),
    f"{LASER}Front/Vertical/{{Left,Right}}/Seg01/{POINT}": (-5.7, 5.7),
    f"{LASER}{SIDE}/{{UncertainObstacle,AnnoyingReflection}}/Seg{{01..15}}/{POINT}": (-5.6, 5.6),
    f"{LASER}{SIDE}/Reg/{{Status,AssertFailCount,RunMode,CalibrDataVer,FrameCount}}/Sensor/Value": (0.0, 65535.0),
    f"{LASER}{SIDE}/Reg/BoardTemp/Sensor/Value": (0.0, 100.0),
    f"{LASER}{SIDE}/Reg/OperationMode/{{Sensor,Actuator}}/Value": (0.0, 7.0),
    f"{D}Platform/InfraredSpot/{{Left,Right}}/Sensor/Value": (0.0, 1.0),
    f"{D}Platform/{{FrontLeft,FrontRight,Back}}/Bumper/Sensor/Value": (0.0, 1.0),
    f"{D}Head/Touch/{{Front,Middle,Rear}}/Sensor/Value": (0.0, 1.0),
    f"{D}{{LHand,RHand}}/Touch/Back/Sensor/Value": (0.0, 1.0),
    f"{D}ChestBoard/Button/Sensor/Value": (0.0, 1.0),
    f"{D}InertialSensor{{Base,}}/Gyroscope{{X,Y,Z}}/Sensor/Value": (-8.73, 8.73),
    f"{D}InertialSensor{{Base,}}/Accelerometer{{X,Y,Z}}/Sensor/Value": (-19.7, 19.7),
    f"{D}InertialSensor{{Base,}}/Angle{{X,Y,Z}}/Sensor/Value": (-math.pi, math.pi),
    f"{D}Battery/Charge/Sensor/Value": (0.0, 1.0),
    f"{D}Battery/Current/Sensor/Value": (-20.0, 20.0),
    f"{D}Battery/Temperature{{,Sensor1,Sensor2,Sensor3}}/Sensor/Value": (10.0, 60.0),
    f"{D}Battery/Voltage{{1..8}}/Sensor/Value": (0.0, 4.2),
    f"{D}Platform/ILS/Sensor/Value": (0.0, 1.0),
    f"{D}Face/Led/{{Red,Green,Blue}}/{{Left,Right}}/{{0,45,90,135,180,225,270,315}}Deg/Actuator/Value": (0.0, 1.0),
    f"{D}Ears/Led/{{Left,Right}}/{{0,36,72,108,144,180,216,252,288,324}}Deg/Actuator/Value": (0.0, 1.0),
    f"{D}ChestBoard/Led/{{Red,Green,Blue}}/Actuator/Value": (0.0, 1.0),
    "{Right,Left,Back}BumperPressed": (0.0, 1.0),
    "{Front,Middle,Rear}TactilTouched": (0.0, 1.0),
    "Hand{Right,Left}{Back,Left,Right}Touched": (0.0, 1.0),
    "ChestButtonPressed": (0.0, 1.0),
}
"""Pattern -> least and greatest value; all are floats."""

OTHERS: dict[str, type] = {
    f"{D}{{{JOINT[1:-1]},WheelFL,WheelFR,WheelB}}/Temperature/Sensor/Status": int,
    "DCM/Time": int,
    "RobotConfig/Head/FullHeadId": str,
    "Device/DeviceList/ChestBoard/BodyId": str,
    "RobotConfig/Body/{Type,BaseVersion,Version,SoftwareRequirement}": str,
    "RobotConfig/Body/Device/{LeftArm,RightArm,Hand/Left,Legs,Platform,Brakes,Wheel}/Version": str,
    "Device/DeviceList/BatteryFuelGauge/{SerialNumber,FirmwareVersion}": str,
    "BatteryChargeChanged": int,
    "Battery{PowerPluggedChanged,ChargingFlagChanged,FullChargedFlagChanged,TrapIsOpen}": bool,
    "ALBattery/ConnectedToChargingStation": bool,
    "TouchChanged": list,
    "robotIsWakeUp": bool,
    "AutonomousLife/{State,FocusedActivity,CompletedActivity,NextActivity}": str,
    "AutonomousLife/LaunchSuggestions": list,
    "ALTextToSpeech/Text{Started,Done,Interrupted}": bool,
    "ALTextToSpeech/Current{Sentence,Word}": str,
    "ALTextToSpeech/{CurrentBookMark,PositionOfCurrentWord}": int,
    "ALTextToSpeech/Status": list,
}
"""Pattern -> type."""

EVENTS = [
    "ALMotion/Stiffness/wakeUp{Started,Finished}",
    "ALMotion/{MoveFailed,Safety/ChainVelocityClipped,RobotIsFalling,RobotIsStand,Protection/DisabledDevicesChanged}",
    "{robotHasFallen,PostureChanged,PostureFamilyChanged,BodyStiffnessChanged}",
    "Sonar{Left,Right}{,Nothing}Detected",
    "{ALChestButton/SimpleClickOccurred,ALSystem/RobotNameChanged,HotDeviceDetected,TemperatureStatusChanged}",
]
"""Patterns of events whose value has no documented type, or none before they happen."""


def read(memory, patterns) -> dict[str, tuple[str, object]]:
    """Key -> its pattern and its value, as getListData answers them."""
    pattern_of = {key: pattern for pattern in patterns for key in expand(pattern)}
    keys = list(pattern_of)
    values = [value for i in range(0, len(keys), CHUNK) for value in memory.getListData(keys[i : i + CHUNK])]
    return {key: (pattern_of[key], value) for key, value in zip(keys, values, strict=True)}


def test_every_number_is_a_finite_float_within_its_range(naoqi):
    answers = read(naoqi.ALMemory, NUMBERS)
    assert len(answers) > 550
    wrong = {
        key: value
        for key, (pattern, value) in answers.items()
        if not isinstance(value, float)
        or not math.isfinite(value)
        or not NUMBERS[pattern][0] - 1e-3 <= value <= NUMBERS[pattern][1] + 1e-3
    }
    assert not wrong


def test_everything_else_has_its_type(naoqi):
    wrong = {
        key: value
        for key, (pattern, value) in read(naoqi.ALMemory, OTHERS).items()
        if type(value) is not OTHERS[pattern]
    }
    assert not wrong


@pytest.mark.parametrize("patterns", [NUMBERS, OTHERS, EVENTS], ids=["numbers", "others", "events"])
def test_each_pattern_can_be_read_with_get_data(naoqi, patterns):
    for pattern in patterns:
        for key in {*expand(pattern)[:1], *expand(pattern)[-1:]}:
            naoqi.ALMemory.getData(key)  # an unknown key raises


def test_every_event_is_known_before_it_happens(naoqi):
    memory = naoqi.ALMemory
    names = [name for pattern in EVENTS for name in expand(pattern)]
    assert set(names) <= set(memory.getEventList())
    for name in names:
        memory.getData(name)


def test_nothing_is_uncertain_or_reflected(naoqi):
    """Such a point reads as a segment of the laser that meets nothing: at the limit of the range, in its direction."""
    memory = naoqi.ALMemory
    for side, kind in product(("Front", "Left", "Right"), ("UncertainObstacle", "AnnoyingReflection")):
        for segment, bearing in ((1, 28.0), (8, 0.0), (15, -28.0)):
            x, y = memory.getListData([f"{LASER}{side}/{kind}/Seg{segment:02d}/{axis}/Sensor/Value" for axis in "XY"])
            assert (math.hypot(x, y), math.degrees(math.atan2(y, x))) == pytest.approx((5.6, bearing))


def test_laser_boards_run_all_their_lasers(naoqi):
    keys = [f"{LASER}{side}/Reg/OperationMode/{{}}/Value" for side in ("Front", "Left", "Right")]
    for part in ("Sensor", "Actuator"):
        assert naoqi.ALMemory.getListData([key.format(part) for key in keys]) == [7.0, 1.0, 1.0]
