from __future__ import annotations

import math

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


def test_switches_are_pressed_above_one_half():
    values = [0.0] * len(SWITCHES)
    values[list(SWITCHES).index("head/middle")] = 1.0
    pressed = read_switches(values)
    assert [name for name, down in pressed.items() if down] == ["head/middle"]


def test_a_missing_switch_is_left_out():
    pressed = read_switches([None, *[0.0] * (len(SWITCHES) - 1)])
    assert set(SWITCHES) - set(pressed) == {"bumper/right"}


def test_battery_with_and_without_a_plug_sensor():
    assert len(BATTERY_KEYS) == 3
    assert read_battery([0.8, -2.5, True]).plugged is True
    battery = read_battery([None, -2.5, None])
    assert battery.plugged is None
    assert math.isnan(battery.charge)


def test_hot_joints_are_named():
    joints = ["HeadYaw", "KneePitch", "LHand"]
    assert len(temperature_keys(joints)) == 6
    temperatures = read_temperatures(joints, [38.0, 0, 78.0, 2, None, None])
    assert temperatures.celsius == {"HeadYaw": 38.0, "KneePitch": 78.0}
    assert temperatures.hot == ["KneePitch"]


def test_what_the_robot_is_leaves_out_what_it_does_not_know():
    values = ["AP99\x1b[2J", None, "Juliette", *[None] * (len(INFO_KEYS) - 3)]
    told = read_info(values)
    assert told.startswith("RobotConfig/Head/FullHeadId: AP99") and told.isprintable()
    assert told.endswith(" ; RobotConfig/Body/Type: Juliette")
