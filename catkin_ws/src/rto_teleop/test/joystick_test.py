#!/usr/bin/env python3
"""joystick.launch: the stick drives while the drive button is held."""

import os
import time

import rospy
import rostest
from telepresence_ros.launch_test import LaunchTest

from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

LB, RB = 4, 5


class Joystick(LaunchTest):
    nodes = ("/rto3/rto_teleop_joystick",)

    def test_stick_drives_while_the_button_is_held(self):
        self.watch_velocities("/rto3/cmd_vel")
        self.plug_in(rospy.get_param("~device"))
        self.send(AXIS, 1, -32767)
        self.send(BUTTON, RB, 0)
        self.send(BUTTON, RB, 1)
        time.sleep(0.5)
        self.assertEqual(self.velocities("/rto3/cmd_vel"), [], "RB is not the dead man's switch")
        self.send(BUTTON, RB, 0)
        self.until(lambda: self.drives(0.3), "full speed ahead")
        self.until(lambda: self.drives(0.6, RB), "RB is fast")
        self.send(BUTTON, LB, 0)
        self.until(lambda: self.velocities("/rto3/cmd_vel")[-1] == [0.0, 0.0, 0.0], "zeros when the button is let go")

    def plug_in(self, path):
        """The node looks for its gamepad every second."""
        self.probe.watch("/rosout", "rosgraph_msgs/Log", ["msg"])
        os.mkfifo(path)
        self.addCleanup(os.unlink, path)
        self._pad = os.open(path, os.O_RDWR)
        self.addCleanup(os.close, self._pad)
        self.until(
            lambda: any(f"gamepad at {path}" in fields[0] for _, fields in self.probe.seen("/rosout")), "it is found"
        )

    def send(self, kind, number, value):
        os.write(self._pad, EVENT.pack(0, value, kind, number))

    def drives(self, speed, *buttons):
        """Push the stick and press the buttons; whether the robot is told this speed [m/s] within a moment. A stick
        that rests for two seconds counts as stuck, and on a busy machine they may be over before the first command."""
        self.send(BUTTON, LB, 0)
        self.send(AXIS, 1, 0)
        time.sleep(0.2)  # longer than the node takes to see it
        self.send(AXIS, 1, -32767)
        for button in (LB, *buttons):
            self.send(BUTTON, button, 1)
        ends = time.monotonic() + 2.0
        while time.monotonic() < ends:
            if any(abs(vx - speed) < 1e-6 and vy == wz == 0.0 for vx, vy, wz in self.velocities("/rto3/cmd_vel")):
                return True
            time.sleep(0.02)
        return False


if __name__ == "__main__":
    rostest.rosrun("rto_teleop", "joystick", Joystick)
