#!/usr/bin/env python3
"""The operator's window as a node, with a robot that runs already: it shows the robot's picture, keys in its terminal
drive the robot, and it ends like a node."""

import os
import subprocess
import threading
import time
from itertools import pairwise
from statistics import median

import numpy as np
import rosnode
import rospy
import rostest
from sensor_msgs.msg import Image
from telepresence_ros.launch_test import LaunchTest

from gui.terminal.tmux import Tmux, TmuxError
from telepresence.station.virtual_display import VirtualDisplay, grab
from telepresence.video.images import fill_image_message

READY = "a key holds until the next one"
RED, BLUE = (250, 30, 20), (20, 30, 250)
DRIVEN, ZERO = [0.2, 0.0, 0.0], [0.0, 0.0, 0.0]


class Window(LaunchTest):
    nodes = ("/drive_lease",)
    pressed = 0.0
    drive_topic = "/nowhere"  # the test is the robot: what listens on cmd_vel and does not drive

    def setUp(self):
        super().setUp()
        self.watch_velocities("/cmd_vel")
        images = rospy.Publisher("/pepper_robot/camera/front/image_raw", Image, queue_size=1)
        ended = threading.Event()
        camera = threading.Thread(target=self.publish, args=(images, ended), name="camera")
        camera.start()
        self.addCleanup(camera.join)
        self.addCleanup(ended.set)
        self.display = VirtualDisplay()
        self.addCleanup(self.display.close)
        self.environment = {**os.environ, **self.display.environment, "TELEPRESENCE_SETTINGS": "none"}
        words = ("roslaunch", "avatar_gui", "gui.launch", "sign_in:=false")
        self.launch = self.start(
            *words, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.until(lambda: "/gui_ros_node" in self.probe.nodes(), "the window has joined the graph")
        self.tmux = Tmux(f"telepresence-{self.probe.pid('/gui_ros_node')}")

    def test_a_running_robot_is_shown_and_driven_from_the_terminal_until_the_node_is_ended(self):
        self.until(lambda: READY in self.terminal_text(), "the keyboard runs in the terminal")
        self.until(self.shows_picture, "the picture is on the screen")
        self.assertFalse(self.terminal_has_keyboard(), "keys drive until somebody asks for the terminal")
        self.xdotool("key", "F6")
        self.until(self.terminal_has_keyboard, "the terminal has the keyboard")

        self.until(lambda: self.last_command() == ZERO, "the window takes the robot, which stands")
        self.probe.forget("/cmd_vel")
        commands = self.until(self.twenty_after_a_key, "the robot hears the key, again and again")
        self.assertTrue(0.08 < median(after[0] - before[0] for before, after in pairwise(commands[1:])) < 0.12)

        self.xdotool("key", "k")
        self.until(lambda: self.last_command() == ZERO, "k stops")
        self.until(lambda: self.velocities("/cmd_vel").count(ZERO) >= 5, "zero is repeated")
        last = self.probe.seen("/cmd_vel")[-1][0]
        self.until(lambda: time.time() > self.probe.seen("/cmd_vel")[-1][0] + 1.5, "the topic is quiet", timeout=10.0)
        self.assertLess(self.probe.seen("/cmd_vel")[-1][0] - last, 1.0)

        rosnode.kill_nodes(["/gui_ros_node"])
        output, _ = self.launch.communicate(timeout=30)
        self.assertIn("ROS ended this window", output)
        self.assertIn("gui_ros_node-1] process has finished cleanly", output)

    def publish(self, images, ended):
        """A picture, left half red, right half blue, 20 times a second."""
        pixels = np.zeros((48, 64, 3), np.uint8)
        pixels[:, :32], pixels[:, 32:] = RED, BLUE
        while not ended.wait(0.05):
            images.publish(fill_image_message(Image(), pixels, "rgb8"))

    def shows_picture(self):
        """Whether much of the screen is red, and as much is blue, further to the right."""
        screen = grab(self.display.folder)[::8, ::8, ::-1].astype(int)
        red, blue = (np.nonzero(np.abs(screen - colour).max(axis=2) < 50)[1] for colour in (RED, BLUE))
        return min(len(red), len(blue)) > 300 and np.median(red) + 10 < np.median(blue)

    def last_command(self):
        return self.velocities("/cmd_vel")[-1] if self.velocities("/cmd_vel") else None

    def terminal_text(self):
        try:
            return self.tmux.text("session")
        except TmuxError:
            return ""

    def terminal_has_keyboard(self):
        """Whether the X server sends keys to a window inside the operator's; 0 and 1 are none."""
        windows = self.xdotool("search", "--onlyvisible", "--name", "^Telepresence").split()
        return windows and self.xdotool("getwindowfocus", "-f").strip() not in ("0", "1", windows[0])

    def twenty_after_a_key(self):
        """The last twenty commands, if all of them drive. The keyboard lets go of i, as it must, when it is not run for
        half a second, as on a busy machine: then i is pressed again."""
        commands = self.probe.seen("/cmd_vel")[-20:]
        if [fields for _, fields in commands] == [DRIVEN] * 20:
            return commands
        if self.last_command() != DRIVEN and time.monotonic() > self.pressed + 1.0:
            self.xdotool("key", "i")
            self.pressed = time.monotonic()
        return None

    def xdotool(self, *words):
        return subprocess.run(
            ["xdotool", *words], env=self.environment, capture_output=True, text=True, timeout=20
        ).stdout


if __name__ == "__main__":
    rostest.rosrun("avatar_gui", "window", Window)
