"""Gamepad driving as a ROS node.

Subscribes: joy (sensor_msgs/Joy), with _device:=none; the node that publishes it must repeat at 10 Hz or faster.
            drive/hold (std_msgs/String): as long as drive_lease says why nobody may drive, the gamepad does not.
Publishes:  safe_cmd_vel where a safety gate listens, else cmd_vel (geometry_msgs/Twist; see `drive_topic`): 20 Hz while
            the drive button is held, zeros for a moment after, then nothing.
Parameters: ~device (/dev/input/js0): read this gamepad here; none or empty: read none; ~axis_x, ~axis_y, ~axis_turn,
            ~axis_hat_x, ~axis_hat_y, ~button_drive (LB), ~button_turbo (RB), ~scale_linear, ~scale_angular, ~turbo,
            ~dead_zone, ~curve, ~creep:
            see `Layout` in telepresence.teleop.joystick_mapping; ~axis_nod, ~axis_look, ~button_look: with which the
            window turns a head, and nothing turns here. Axes and buttons that no parameter names are the window's:
            found by the kernel's names for them, else an Xbox pad's. ~gate (true): false drives on cmd_vel
            even where there is a gate.
"""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable, Mapping

import rospy
from sensor_msgs.msg import Joy
from telepresence_ros.node import Node

from rto_teleop.drive_topic import DriveTopic
from telepresence.teleop.joystick import Joystick
from telepresence.teleop.joystick_layouts import XBOX, JoystickLayout, layout_of
from telepresence.teleop.joystick_mapping import JoystickMapping, Layout

PERIOD = 0.05
REMINDER = 5.0
"""Seconds between two sentences about why the gamepad moves nothing."""
NO_DEVICE = ("none", "")
"""Roslaunch and rosrun drop an argument without a value, so that only a launch file can give an empty one."""
LOOK_PERIOD = 1.0
"""Seconds between two attempts to open a gamepad that is not there."""
PARAMETERS = {field.name: field.name for field in dataclasses.fields(Layout)}
"""Private parameter -> what it sets in a `Layout`."""


class JoystickNode:
    """Reads a gamepad, or the topic joy, and publishes what it asks for.

    Args:
        name: The node's, and its program's.
        parameters: As `PARAMETERS`.
        layout: What a pad's axes and buttons do where no parameter says something else.
    """

    def __init__(
        self,
        name: str = "rto_teleop_joystick",
        parameters: Mapping[str, str] = PARAMETERS,
        layout: Callable[[JoystickLayout], Layout] = JoystickLayout.driving,
    ) -> None:
        self._lock = threading.Lock()  # protects the mapping
        self._layout = layout
        self._mapping = JoystickMapping(layout(XBOX))
        self._node = Node(name, on_master_lost=self._lose)
        given = {key: field for key, field in parameters.items() if rospy.has_param(f"~{key}")}
        self._settings = {field: rospy.get_param(f"~{key}") for key, field in given.items()}
        self._take(XBOX)
        self._device = str(rospy.get_param("~device", "/dev/input/js0"))
        self._topic = DriveTopic("cmd_vel", f"rto_teleop {name}", lambda text: rospy.loginfo("%s", text))

    def run(self) -> int:
        """Run until the node is shut down; return the exit code."""
        if self._device not in NO_DEVICE:
            return self._node.run(self._publish, self._read_device, self._watch_topic)
        rospy.Subscriber("joy", Joy, self._on_joy, queue_size=1, tcp_nodelay=True)
        return self._node.run(self._publish, self._watch_topic)

    def _watch_topic(self) -> None:
        self._topic.watch(self._node.stop)

    def _publish(self) -> None:
        for now in self._node.cycles(PERIOD):
            hold = self._topic.hold
            with self._lock:
                if hold:
                    self._mapping.lose()
                velocity = self._mapping.command(now)
            if hold:
                rospy.loginfo_throttle(REMINDER, "The robot stays: %s", hold)
            if velocity is None:
                continue
            self._topic.publish(velocity)
            if any(velocity) and self._topic.problem:
                rospy.logwarn_throttle(REMINDER, "%s", self._topic.problem)

    def _take(self, pad: JoystickLayout) -> str:
        """Map the axes and buttons of this pad; return the name of the button that lets it drive."""
        layout = dataclasses.replace(self._layout(pad), **self._settings)
        with self._lock:
            self._mapping = JoystickMapping(layout)
        return {pad.LB: "LB", pad.RB: "RB"}.get(layout.button_drive, f"button {layout.button_drive}")

    def _lose(self) -> None:
        with self._lock:
            self._mapping.lose()

    def _on_joy(self, message: Joy) -> None:
        with self._lock:
            self._mapping.update(message.axes, message.buttons, time.monotonic())

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
            button = self._take(layout_of(pad.axis_codes, pad.button_codes))
            rospy.loginfo("gamepad at %s: hold %s and move the sticks", self._device, button)
            try:
                while not self._node.stop.is_set():
                    pad.wait(PERIOD)
                    with self._lock:
                        self._mapping.update(pad.axes, pad.buttons, time.monotonic())
            except OSError as error:
                rospy.logwarn("%s; the robot stops", error)
                self._lose()
                self._node.stop.wait(LOOK_PERIOD)
            finally:
                pad.close()


def main() -> int:
    """Run the node; the exit code."""
    return JoystickNode().run()
