#!/usr/bin/env python3
"""The safe pair of the Robotino guide: keys drive through the gate, which stops the robot before a wall."""

import signal

import rostest
from telepresence_ros.launch_test import LaunchTest

from telepresence.station import processes

COMMANDS = "/rto3/safe_cmd_vel"
ZERO = [0.0, 0.0, 0.0]
RED_STOP = ("rostopic", "pub", "-l", "/rto3/drive/hold", "std_msgs/String", "anna has pressed the red stop.")
REFUSAL = "The robot stays: anna has pressed the red stop."


class SafeTeleop(LaunchTest):
    nodes = ("/robot_control_node", "/rto3/rto_core", "/rto3/rto_odometry", "/rto3/safe_omni_drive")
    drive_topic = COMMANDS

    def prepare(self):
        self.watch_velocities(COMMANDS)
        self.probe.watch("/rto3/odom", "nav_msgs/Odometry", ["pose.pose.position.y", "twist.twist.linear.y"])
        self.probe.watch("/rto3/safety_state", "std_msgs/String", ["data"])
        self.probe.watch("/rto3/bumper", "std_msgs/Bool", ["data"])

    def setUp(self):
        super().setUp()
        self.until(lambda: self.newest("/rto3/safety_state")[0].startswith("no command"), "the gate is ready")

    def test_a_wall_stops_the_robot_and_the_gate_says_why(self):
        """The robot starts 1.5 m from the wall on its right."""
        self.probe.drive(0.0, -0.2, 0.0)

        def blocked():
            state = self.newest("/rto3/safety_state")[0]
            return state.startswith("blocked") and "obstacle" in state

        self.until(blocked, "the gate blocks, because of an obstacle")
        self.assertFalse(self.latest("/rto3/bumper")[0])
        self.assertAlmostEqual(self.latest("/rto3/odom")[0], -1.2, delta=0.12)
        self.probe.silence()

    def test_held_keys_drive_until_they_are_let_go(self):
        keyboard = self.open_keyboard()
        for key, wanted in (("w", [0.05, 0.0, 0.0]), ("q", [0.0, 0.0, 0.5]), ("a", [0.0, 0.05, 0.0])):
            self.hold(keyboard, key, wanted)
            self.until(lambda: self.velocities(COMMANDS)[-1] == ZERO, "zeros follow")
        self.until(lambda: abs(self.latest("/rto3/odom")[1]) < 0.005, "the robot stands")

    def test_keys_do_nothing_while_nobody_may_drive(self):
        keyboard = self.open_keyboard()
        self.hold(keyboard, "w", [0.05, 0.0, 0.0])
        hold = self.start(*RED_STOP)
        self.until(lambda: keyboard.type("w") or REFUSAL in keyboard.seen, "it says why the robot stays")
        self.until(lambda: self.velocities(COMMANDS)[-1] == ZERO, "the robot stops")
        processes.end(hold)
        self.hold(keyboard, "s", [-0.05, 0.0, 0.0])

    def test_the_keyboards_last_word_is_a_zero(self):
        keyboard = self.open_keyboard()
        begin = self.latest("/rto3/odom")[0]
        self.until(
            lambda: keyboard.type("a") or self.latest("/rto3/odom")[0] > begin + 0.02, "the robot drives to the left"
        )
        # A key that came late, from a busy machine, counts as let go for a moment.
        self.until(
            lambda: keyboard.type("a") or self.velocities(COMMANDS)[-1] == [0.0, 0.05, 0.0], "it is told to go on"
        )
        keyboard.type("a")
        keyboard.process.send_signal(signal.SIGINT)
        self.assertEqual(keyboard.process.wait(10.0), 0)
        self.until(lambda: self.velocities(COMMANDS)[-1] == ZERO, "the last velocity is zero")

    def open_keyboard(self):
        keyboard = self.open_terminal("rosrun", "rto_safe_teleop", "safe_keyboard_teleop", "__ns:=/rto3")
        self.until(lambda: "0.050 m/s" in keyboard.seen, "it says how fast it drives")
        self.probe.forget(COMMANDS)
        return keyboard

    def hold(self, keyboard, key, wanted):
        """Hold a key, as a terminal repeats it, until the robot is commanded so."""
        self.until(lambda: keyboard.type(key) or wanted in self.velocities(COMMANDS), f"{key!r} gives {wanted}")


if __name__ == "__main__":
    rostest.rosrun("rto_safe_teleop", "safe_teleop", SafeTeleop)
