#!/usr/bin/env python3
"""Bumpers, touch, battery and temperatures, and which robot it is.

Publishes:  bumper (naoqi_bridge_msgs/Bumper), head_touch (HeadTouch), hand_touch (HandTouch), each when it changes;
            battery (sensor_msgs/BatteryState) once a second; info (naoqi_bridge_msgs/StringStamped, latched: serial
            numbers and versions, anew with each connection); /diagnostics: battery and joint temperatures.
Parameters: ~rate (10) [Hz] of looking at bumpers and touch.
"""

import math
import sys
from typing import Any

import rospy
from naoqi_bridge_msgs.msg import Bumper, HandTouch, HeadTouch, StringStamped
from naoqi_driver.body import MOST_JOINTS
from naoqi_driver.condition import (
    BATTERY_KEYS,
    INFO_KEYS,
    SWITCHES,
    Battery,
    Temperatures,
    read_battery,
    read_info,
    read_switches,
    read_temperatures,
    temperature_keys,
)
from naoqi_driver.connection import RobotError
from naoqi_driver.naoqi_node import NaoqiNode
from naoqi_driver.replies import names
from sensor_msgs.msg import BatteryState
from telepresence_ros.diagnostics import ERROR, OK, WARN, Diagnostics

from telepresence.security.change_log import ChangeLog

LOW_CHARGE = 0.2
"""Below this the diagnostics warn."""
SLOW_PERIOD = 1.0

MESSAGES = {
    "bumper/right": ("bumper", Bumper(bumper=Bumper.right)),
    "bumper/left": ("bumper", Bumper(bumper=Bumper.left)),
    "bumper/back": ("bumper", Bumper(bumper=Bumper.back)),
    "head/front": ("head_touch", HeadTouch(button=HeadTouch.buttonFront)),
    "head/middle": ("head_touch", HeadTouch(button=HeadTouch.buttonMiddle)),
    "head/rear": ("head_touch", HeadTouch(button=HeadTouch.buttonRear)),
    "hand/right": ("hand_touch", HandTouch(hand=HandTouch.RIGHT_BACK)),
    "hand/left": ("hand_touch", HandTouch(hand=HandTouch.LEFT_BACK)),
}
"""What can be pressed -> its topic, and its message."""


class Condition:
    def __init__(self) -> None:
        self._node = NaoqiNode("naoqi_condition")
        self._period = 1.0 / float(rospy.get_param("~rate", 10.0))
        self._publishers = {
            "bumper": rospy.Publisher("bumper", Bumper, queue_size=10),
            "head_touch": rospy.Publisher("head_touch", HeadTouch, queue_size=10),
            "hand_touch": rospy.Publisher("hand_touch", HandTouch, queue_size=10),
        }
        self._battery = rospy.Publisher("battery", BatteryState, queue_size=1, latch=True)
        self._info = rospy.Publisher("info", StringStamped, queue_size=1, latch=True)
        self._informed = 0  # at which of the link's connections
        self._info_log = ChangeLog()
        address = str(self._node.connection.address)
        self._diagnostics = {part: Diagnostics(part, address) for part in ("battery", "joint temperatures")}
        self._pressed = dict.fromkeys(SWITCHES, False)
        self._joints: list[str] = []

    def run(self) -> int:
        return self._node.run(self._loop)

    def _loop(self) -> None:
        slow_due = 0.0
        for now in self._node.cycles(self._period):
            try:
                self._publish_switches(read_switches(self._get(list(SWITCHES.values()))))
                if now >= slow_due:
                    slow_due = now + SLOW_PERIOD
                    self._joints = self._joints or self._read_joints()
                    self._publish_battery(read_battery(self._get(list(BATTERY_KEYS))), now)
                    temperatures = self._get(temperature_keys(self._joints))
                    self._publish_temperatures(read_temperatures(self._joints, temperatures), now)
                    self._publish_info(now)
            except RobotError as error:
                for diagnostics in self._diagnostics.values():
                    diagnostics.report(now, ERROR, str(error))

    def _read_joints(self) -> list[str]:
        return names(self._node.connection.call("ALMotion", "getBodyNames", "Body"), MOST_JOINTS, "getBodyNames")

    def _get(self, keys: list[str]) -> Any:
        return self._node.connection.call("ALMemory", "getListData", keys)

    def _publish_switches(self, pressed: dict[str, bool]) -> None:
        for name, now_pressed in pressed.items():
            if now_pressed != self._pressed[name]:
                self._pressed[name] = now_pressed
                topic, message = MESSAGES[name]
                message.state = message.statePressed if now_pressed else message.stateReleased
                self._publishers[topic].publish(message)

    def _publish_info(self, now: float) -> None:
        connections = self._node.connection.connections
        if self._informed == connections:
            return
        try:
            message = StringStamped(data=read_info(self._get(list(INFO_KEYS))))
        except RobotError as error:  # no reason to call battery and temperatures unknown
            self._info_log.note(now, f"the robot does not say what it is: {error}", rospy.logwarn)
            return
        message.header.stamp = rospy.Time.now()
        self._info.publish(message)
        self._informed = connections

    def _publish_battery(self, battery: Battery, now: float) -> None:
        message = BatteryState(
            percentage=battery.charge,
            charge=math.nan,
            capacity=math.nan,
            design_capacity=30.0,
            current=battery.current,
            voltage=math.nan,
            temperature=math.nan,
            present=True,
            power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
        )
        charging = battery.plugged if battery.plugged is not None else battery.current > 0
        message.power_supply_status = (
            BatteryState.POWER_SUPPLY_STATUS_CHARGING if charging else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        )
        message.header.stamp = rospy.Time.now()
        self._battery.publish(message)
        self._diagnostics["battery"].report(
            now, WARN if battery.charge < LOW_CHARGE else OK, f"{battery.charge:.0%}", {"current [A]": battery.current}
        )

    def _publish_temperatures(self, temperatures: Temperatures, now: float) -> None:
        hot = temperatures.hot
        self._diagnostics["joint temperatures"].report(
            now, WARN if hot else OK, f"too warm: {', '.join(hot)}" if hot else "normal", temperatures.celsius
        )


if __name__ == "__main__":
    sys.exit(Condition().run())
