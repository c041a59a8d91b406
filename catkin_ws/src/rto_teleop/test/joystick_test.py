#!/usr/bin/env python3
"""joystick.launch, and rto_core's joystick_teleop.launch: the stick drives while the drive button is held.

Parameters: ~device: the pipe; ~node; ~drive: LB or RB, the other one is fast; ~speed [m/s] at full deflection.
"""

import os
import time

import rospy
import rostest
from telepresence_ros.launch_test import LaunchTest

from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

NUMBERS = {"LB": 4, "RB": 5}


class Joystick(LaunchTest):
    @property
    def nodes(self):
        return (rospy.get_param("~node"),)

    def test_stick_drives_while_the_button_is_held(self):
        self.topic = rospy.get_param("~node").rpartition("/")[0] + "/cmd_vel"
        name, speed = rospy.get_param("~drive"), rospy.get_param("~speed")
        self.drive = NUMBERS[name]
        (turbo,) = {*NUMBERS.values()} - {self.drive}
        self.watch_velocities(self.topic)
        self.plug_in(rospy.get_param("~device"), name)
        self.send(AXIS, 1, -32767)
        self.send(BUTTON, turbo, 0)
        self.send(BUTTON, turbo, 1)
        time.sleep(0.5)
        self.assertEqual(self.velocities(self.topic), [], f"only {name} is the dead man's switch")
        self.send(BUTTON, turbo, 0)
        self.until(lambda: self.drives(speed), "full speed ahead")
        self.until(lambda: self.drives(2.0 * speed, turbo), "the other button is fast")
        self.send(BUTTON, self.drive, 0)
        self.until(lambda: self.velocities(self.topic)[-1] == [0.0, 0.0, 0.0], "zeros when the button is let go")

    def plug_in(self, path, button):
        """The node looks for its gamepad every second, and says which button drives."""
        self.probe.watch("/rosout", "rosgraph_msgs/Log", ["msg"])
        os.mkfifo(path)
        self.addCleanup(os.unlink, path)
        self._pad = os.open(path, os.O_RDWR)
        self.addCleanup(os.close, self._pad)
        self.until(
            lambda: any(f"gamepad at {path}: hold {button} " in said for _, (said,) in self.probe.seen("/rosout")),
            "it is found",
        )

    def send(self, kind, number, value):
        os.write(self._pad, EVENT.pack(0, value, kind, number))

    def drives(self, speed, *buttons):
        """Push the stick and press the buttons; whether the robot is told this speed [m/s] within a moment. A stick
        that rests for two seconds counts as stuck, and on a busy machine they may be over before the first command."""
        self.send(BUTTON, self.drive, 0)
        self.send(AXIS, 1, 0)
        time.sleep(0.2)  # longer than the node takes to see it
        self.send(AXIS, 1, -32767)
        for button in (self.drive, *buttons):
            self.send(BUTTON, button, 1)
        ends = time.monotonic() + 2.0
        while time.monotonic() < ends:
            if any(abs(vx - speed) < 1e-6 and vy == wz == 0.0 for vx, vy, wz in self.velocities(self.topic)):
                return True
            time.sleep(0.02)
        return False


if __name__ == "__main__":
    rostest.rosrun("rto_teleop", "joystick", Joystick)
