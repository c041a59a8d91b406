"""Gamepad driving as a ROS node.

Subscribes: joy (sensor_msgs/Joy), with ~device empty; the node that publishes it must repeat at 10 Hz or faster.
Publishes:  cmd_vel (geometry_msgs/Twist), 20 Hz while the drive button is held, zeros for a moment after, then nothing.
Parameters: ~device (/dev/input/js0): read this gamepad here; ~axis_x, ~axis_y, ~axis_turn, ~button_drive,
            ~button_turbo, ~scale_linear, ~scale_angular, ~turbo, ~dead_zone: see `Layout` in
            telepresence.teleop.joystick_mapping.
"""

from __future__ import annotations

import dataclasses
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
from telepresence_ros.node import Node

from telepresence.teleop.joystick import Joystick
from telepresence.teleop.joystick_mapping import JoystickMapping, Layout

PERIOD = 0.05
LOOK_PERIOD = 1.0
"""Seconds between two looks for a gamepad that is not there."""


class JoystickNode:
    """Reads a gamepad, or the topic joy, and publishes what it asks for."""

    def __init__(self) -> None:
        self._lock = threading.Lock()  # protects the sticks
        self._sticks = JoystickMapping()
        self._node = Node("rto_teleop_joystick", on_master_lost=self._lose)
        settings = {
            field.name: rospy.get_param(f"~{field.name}", field.default) for field in dataclasses.fields(Layout)
        }
        self._sticks = JoystickMapping(Layout(**settings))
        self._device = str(rospy.get_param("~device", "/dev/input/js0"))
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)

    def run(self) -> int:
        """Until the node is shut down; the exit code."""
        if self._device:
            return self._node.run(self._publish, self._read_device)
        rospy.Subscriber("joy", Joy, self._on_joy, queue_size=1, tcp_nodelay=True)
        return self._node.run(self._publish)

    def _publish(self) -> None:
        for now in self._node.cycles(PERIOD):
            with self._lock:
                velocity = self._sticks.command(now)
            if velocity is not None:
                message = Twist()
                message.linear.x, message.linear.y, message.angular.z = velocity
                self._publisher.publish(message)

    def _lose(self) -> None:
        with self._lock:
            self._sticks.lose()

    def _on_joy(self, message: Joy) -> None:
        with self._lock:
            self._sticks.update(message.axes, message.buttons, time.monotonic())

    def _read_device(self) -> None:
        missing = False
        while not self._node.stop.is_set():
            try:
                pad = Joystick(self._device)
            except OSError as error:
                if not missing:
                    rospy.logwarn("no gamepad at %s (%s); looking again every second", self._device, error.strerror)
                missing = True
                self._node.stop.wait(LOOK_PERIOD)
                continue
            missing = False
            rospy.loginfo("gamepad at %s: hold the drive button and move the sticks", self._device)
            try:
                while not self._node.stop.is_set():
                    pad.wait(PERIOD)
                    with self._lock:
                        self._sticks.update(pad.axes, pad.buttons, time.monotonic())
            except OSError as error:
                rospy.logwarn("%s; the robot stops", error)
                self._lose()
                self._node.stop.wait(LOOK_PERIOD)
            finally:
                pad.close()


def main() -> int:
    """Run the node; the exit code."""
    return JoystickNode().run()
