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

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
from telepresence_ros.master_watch import MasterWatch

from telepresence.station.ros_master import master_answers
from telepresence.teleop.joystick import Joystick
from telepresence.teleop.joystick_mapping import JoystickMapping, Layout

PERIOD = 0.05
LOOK_PERIOD = 1.0
"""Seconds between two looks for a gamepad that is not there."""


class JoystickNode:
    def __init__(self, sticks: JoystickMapping, device: str) -> None:
        self._sticks = sticks
        self._device = device
        self._stop = threading.Event()
        self._lock = threading.Lock()  # guards the sticks
        self._publisher = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.on_shutdown(self._stop.set)
        self._master = MasterWatch(rospy, on_lost=self._lose).start()

    def run(self) -> None:
        """Until the node is shut down."""
        if self._device:
            threading.Thread(target=self._read_device, name="gamepad", daemon=True).start()
        else:
            rospy.Subscriber("joy", Joy, self._on_joy, queue_size=1, tcp_nodelay=True)
        while not self._stop.wait(PERIOD):
            with self._lock:
                velocity = self._sticks.command(time.monotonic())
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
        while not self._stop.is_set():
            try:
                pad = Joystick(self._device)
            except OSError as error:
                if not missing:
                    rospy.logwarn("no gamepad at %s (%s); looking again every second", self._device, error.strerror)
                missing = True
                self._stop.wait(LOOK_PERIOD)
                continue
            missing = False
            rospy.loginfo("gamepad at %s: hold the drive button and move the sticks", self._device)
            try:
                while not self._stop.is_set():
                    pad.wait(PERIOD)
                    with self._lock:
                        self._sticks.update(pad.axes, pad.buttons, time.monotonic())
            except OSError as error:
                rospy.logwarn("%s; the robot stops", error)
                self._lose()
                self._stop.wait(LOOK_PERIOD)
            finally:
                pad.close()


def main() -> int:
    """Run the node; the exit code."""
    uri = rosgraph.get_master_uri()
    if not master_answers(uri, timeout=2.0):
        print(f"no ROS master answers at {uri}: start roscore, or set ROS_MASTER_URI to where one runs")
        return 1
    rospy.init_node("rto_teleop_joystick")
    settings = {field.name: rospy.get_param("~" + field.name, field.default) for field in dataclasses.fields(Layout)}
    JoystickNode(JoystickMapping(Layout(**settings)), rospy.get_param("~device", "/dev/input/js0")).run()
    return 0
