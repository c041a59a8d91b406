"""What launch conditions ask about: the words, and that a condition sees them."""

import datetime
from types import SimpleNamespace

import pytest

from pepper_sim.naoqi import launchpad

NOW = datetime.datetime(2026, 2, 1, 13, 30)


def values(charge=0.5, fell=None, **temperatures):
    snapshot = SimpleNamespace(
        battery=SimpleNamespace(charge=charge), temperatures={"HeadYaw": 30.0, **temperatures}, joint_positions={}
    )
    found = launchpad.values(snapshot, "Stand", "Standing", False, fell, NOW)
    return {key.removeprefix("Launchpad/"): value for key, value in found.items()}


@pytest.mark.parametrize(
    ("charge", "level", "word"), [(0.05, 0, "Critical"), (0.2, 1, "Low"), (0.5, 2, "Half"), (1.0, 5, "Full")]
)
def test_the_battery(charge, level, word):
    found = values(charge)
    assert (found["BatteryLevel"], found["BatteryStatus"]) == (level, word)


def test_the_hottest_motor_a_fall_and_the_time():
    found = values(fell=5.0, HipPitch=80.0)
    assert (found["TemperatureStatus"], found["HighestJoint"], found["HighestTemperature"]) == ("Hot", "HipPitch", 80.0)
    assert found["RobotFellRecently"] is True and values(fell=14.0)["RobotFellRecently"] is False
    assert (found["MonthName"], found["Day"], found["DayName"], found["Hour"]) == ("February", 32, "Sunday", 13)


def test_a_condition_sees_them(naoqi, wait_until):
    condition = (
        "'Launchpad/RobotType' == \"pepper\" && 'Launchpad/PostureFamily' == \"Standing\" && 'Launchpad/Year' > 2000"
    )
    watched = naoqi.ALExpressionWatcher.add(condition, 1)
    wait_until(watched.getValue, "the robot stands")
