#!/usr/bin/env python3
"""teleop.launch in a terminal, below roslaunch, which puts the node into a session without a terminal of its own: a key
drives until k, and then the topic is quiet."""

import time
from itertools import pairwise
from statistics import median

import rostest
from telepresence_ros.launch_test import LaunchTest

ZERO = [0.0, 0.0, 0.0]


class Teleop(LaunchTest):
    pressed = 0.0

    def prepare(self):
        self.watch_velocities("/cmd_vel")

    def test_a_key_drives_until_k_and_then_the_topic_is_quiet(self):
        terminal = self.open_terminal("roslaunch", "teleop_twist_keyboard", "teleop.launch")
        self.until(lambda: "currently:" in terminal.seen, "the help is printed")
        driven = self.until(lambda: self.driven(terminal, "i", [0.2, 0.0, 0.0], 20), "the command is repeated")
        periods = [after[0] - before[0] for before, after in pairwise(driven[1:])]
        self.assertTrue(0.08 < median(periods) < 0.12, periods)

        terminal.type("k")
        self.until(lambda: self.velocities("/cmd_vel")[-1] == ZERO, "k stops")
        self.until(lambda: self.driven(terminal, "j", [0.0, 0.0, 0.5], 1), "j turns")
        terminal.type("k")
        self.until(lambda: self.velocities("/cmd_vel")[-1] == ZERO, "k stops again")
        stopped = self.last_command()
        self.until(lambda: self.last_command() > stopped + 0.3, "zero is repeated")
        self.until(lambda: time.time() > self.last_command() + 1.5, "the topic is quiet", timeout=10.0)
        self.assertLess(self.last_command(), stopped + 1.5)

        self.assertIn("\r\nforward\r\n", terminal.seen)
        self.assertNotIn("\n", terminal.seen.replace("\r\n", ""))
        terminal.type("\x03")
        terminal.process.wait(20)
        self.assertTrue(terminal.echoes() and terminal.takes_lines())

    def driven(self, terminal, key, wanted, count):
        """The last commands, if all of them are as wanted. The node lets go of a key, as it must, when it is not run
        for half a second, as on a busy machine: then the key is pressed again."""
        commands = self.probe.seen("/cmd_vel")[-count:]
        if [fields for _, fields in commands] == [wanted] * count:
            return commands
        if self.velocities("/cmd_vel")[-1:] != [wanted] and time.monotonic() > self.pressed + 1.0:
            terminal.type(key)
            self.pressed = time.monotonic()
        return None

    def last_command(self):
        """When the last command came [s since 1970]."""
        return self.probe.seen("/cmd_vel")[-1][0]


if __name__ == "__main__":
    rostest.rosrun("teleop_twist_keyboard", "teleop", Teleop)
