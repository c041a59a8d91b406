#!/usr/bin/env python3
"""keyboard.launch in a terminal: a held key drives, zeros follow, and Ctrl-C ends it; and rto_core's line for it."""

import rostest
from telepresence_ros.launch_test import LaunchTest

ZERO, FORWARD, TURN = [0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.5]


class Keyboard(LaunchTest):
    # Who publishes on /cmd_vel, too, does not count as a robot there: a program in the root namespace drives another.
    drive_topic = "/nobody/cmd_vel"

    def test_a_held_key_drives_and_ctrl_c_ends_it(self):
        self.drive_by("/rto3/cmd_vel", "keyboard.launch", "scale_linear:=2.0")

    def test_the_line_of_rto_core_drives_in_the_root_namespace(self):
        self.drive_by("/cmd_vel", "keyboard_teleop.launch")

    def drive_by(self, topic, *line):
        self.watch_velocities(topic)
        terminal = self.open_terminal("roslaunch", "rto_teleop", *line)
        self.until(lambda: "0.100 m/s" in terminal.seen, "it says how fast it drives")
        self.until(lambda: terminal.type("w") or FORWARD in self.velocities(topic), "W drives forward")
        self.until(lambda: self.velocities(topic)[-1] == ZERO, "zeros follow")
        self.until(lambda: terminal.type("q") or TURN in self.velocities(topic), "Q turns")
        self.until(lambda: self.velocities(topic)[-1] == ZERO, "zeros follow again")
        others = [given for given in self.velocities(topic) if given not in (ZERO, FORWARD, TURN)]
        self.assertEqual(others, [])
        terminal.type("\x03")
        self.assertEqual(terminal.process.wait(30), 0)
        self.assertTrue(terminal.echoes() and terminal.takes_lines())


if __name__ == "__main__":
    rostest.rosrun("rto_teleop", "keyboard", Keyboard)
