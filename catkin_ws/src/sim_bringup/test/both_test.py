#!/usr/bin/env python3
"""Pepper and Robotino in one world on one master."""

import json
import math
import os
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import rospy
import rostest
from telepresence_ros.launch_test import LaunchTest, environment_of

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "custom_controller.py"
DRIVE_PATIENCE = 40.0
"""Seconds that a robot has to get somewhere, on a machine that is busy."""
STILL = 0.002
"""A robot that nobody drives moves less than this [m]."""
TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/rto3/odom": "nav_msgs/Odometry",
    "/body_state": "std_msgs/Float32MultiArray",
    "/rto3/body_state": "std_msgs/Float32MultiArray",
    "/robot_camera": "sensor_msgs/Image",
    "/rto3/robot_camera": "sensor_msgs/Image",
    "/rto3/tf": "tf2_msgs/TFMessage",
    "/voice/levels": "std_msgs/Float32MultiArray",
    "/rto3/voice/levels": "std_msgs/Float32MultiArray",
}
FLOOD = """
import rospy
from std_msgs.msg import Int32
rospy.init_node("flood")
publisher = rospy.Publisher("/rto3/movement_command", Int32, queue_size=10)
rate = rospy.Rate(1000)
while not rospy.is_shutdown():
    publisher.publish(1)
    rate.sleep()
"""


class Both(LaunchTest):
    nodes = (
        "/robot_control_node",
        "/naoqi_driver",
        "/pepper_robot/pepper_laser",
        "/pepper_robot/camera/front",
        "/rto3/rto_core",
        "/rto3/rto_odometry",
        "/rto3/rto_drive_link",
        "/voice",
        "/rto3/rto_voice",
    )

    def prepare(self):
        for robot in ("", "/rto3"):
            self.probe.watch(f"{robot}/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
            self.probe.watch(f"{robot}/safety_state", "std_msgs/String", ["data"])
            image = ["width", "height", "encoding", "header.frame_id"]
            self.probe.watch(f"{robot}/robot_camera", "sensor_msgs/Image", image)
        self.probe.watch("/rosout", "rosgraph_msgs/Log", ["msg"])

    def setUp(self):
        super().setUp()
        self.simulator = self.probe.pid("/robot_control_node")

    def test_all_programs_of_both_are_on_one_master(self):
        self.expect_topics(TOPICS)

    def test_pepper_drives_alone(self):
        self.drives_alone("", "/rto3")

    def test_robotino_drives_alone(self):
        self.drives_alone("/rto3", "")

    def test_the_pilot_is_connected_with_the_sound_of_both(self):
        """Here without a sound card, which both say; the links stand."""
        url = f"http://{rospy.get_param('~address')}:8084/sound"
        self.until(
            lambda: json.load(urllib.request.urlopen(url, timeout=10))["pilots"] == 1, "the pilot is at Robotino"
        )
        for namespace in ("", "/rto3"):
            answered, answer = self.probe.call(f"{namespace}/voice/talk", "std_srvs/SetBool", {"data": False})
            self.assertTrue(answered and answer["success"] and "not connected" not in answer["message"], answer)

    def test_commands_that_mean_nothing_stop_the_robot(self):
        self.restart()
        self.probe.order("/rto3/movement_command", 1)
        self.wait_for_way("/rto3", 0.05)
        self.probe.order("/rto3/movement_command", 7)
        self.until(lambda: "movement_command 7 means nothing" in str(self.probe.seen("/rosout")), "the node says so")
        self.until(lambda: self.stands("/rto3"), "it stops")
        stands = self.place("/rto3")
        stranger = self.start(
            *("rostopic", "pub", "-r", "20", "/rto3/movement_command", "std_msgs/String", "1"),
            stdout=subprocess.DEVNULL,
        )
        self.until(lambda: "/rostopic" in " ".join(self.probe.nodes()), "the wrong type is published")
        for _ in range(10):
            self.assertLess(math.dist(self.place("/rto3"), stands), STILL)
        stranger.kill()

    def test_a_flood_of_commands_is_coalesced(self):
        """A thousand a second; the robot follows, its driver receives few of them, and it stops when they cease."""
        self.restart()
        self.watch_velocities("/rto3/safe_cmd_vel")
        flood = self.start(sys.executable, "-c", FLOOD)
        self.wait_for_way("/rto3", 0.2)
        times = [when for when, _ in self.probe.seen("/rto3/safe_cmd_vel")]
        self.assertLess(len(times), 10 + 60 * (times[-1] - times[0]), "the driver is told at most fifty times a second")
        flood.kill()
        self.until(lambda: self.stands("/rto3"), "it stops")

    def test_the_example_of_an_own_controller_runs_as_it_is_written(self):
        self.restart()
        program = subprocess.run(
            [sys.executable, str(EXAMPLE), "__ns:=/rto3", "_distance:=0.1", "_timeout:=40"],
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(program.returncode, 0, program.stdout + program.stderr)
        self.assertIn("m forward; now back", program.stdout)
        self.assertIn("back where it began", program.stdout)
        # It decides ten times a second at 0.2 m/s, and on a busy machine late.
        self.assertAlmostEqual(self.place("/rto3")[0], 0.0, delta=0.25)

    def test_pictures_of_both_come_through_their_own_wires(self):
        for robot in ("", "/rto3"):
            self.assertEqual(self.latest(f"{robot}/robot_camera"), [640, 480, "rgb8", "robot_camera"])

    def test_one_restart_puts_both_back(self):
        self.restart("/rto3/restart_simulation")
        self.expect_at_start()

    def test_two_hundred_restarts_under_load(self):
        """Viewer open, both cameras drawn, both robots driven: memory stays flat and everybody connected."""
        began = {node: self.probe.pid(node) for node in self.nodes}
        self.until(self.viewer_is_open, "the viewer is open")
        self.probe.order("/rto3/movement_command", 1)
        self.restart_often(20)
        self.until(self.memory_is_steady, "the cameras have what they need")
        before = self.memory()
        self.probe.drive(0.2, 0.0, 0.3)
        self.restart_often(90)
        self.probe.silence()
        self.restart_often(90)
        self.assertTrue(self.viewer_is_open())
        self.assertLess(self.memory(), before + 15.0, "the simulator grows")
        self.expect_at_start()
        for robot in ("", "/rto3"):
            self.assertEqual(self.latest(f"{robot}/robot_camera")[:2], [640, 480], "pictures go on")
        self.probe.order("/movement_command", 2)
        self.wait_for_way("", 0.05)
        self.probe.order("/movement_command", 0)
        self.probe.order("/rto3/movement_command", 0)
        self.assertEqual({node: self.probe.pid(node) for node in self.nodes}, began, "nothing died")

    def drives_alone(self, driven, other):
        """Through safety gate, driver and wire of the one; the other stands."""
        self.until(lambda: self.stands(other), "the other stands")
        stood = self.place(other)
        # Somebody who gives one movement command and stays.
        pilot = self.start(
            "rostopic", "pub", f"{driven}/movement_command", "std_msgs/Int32", "1", stdout=subprocess.DEVNULL
        )
        self.wait_for_way(driven, 0.15)
        pilot.terminate()
        self.until(lambda: self.stands(driven), "it stops when whoever commanded is gone")
        self.assertLess(math.dist(self.place(other), stood), STILL)

    def restart(self, service="/restart_simulation"):
        answered, answer = self.probe.call(service, "std_srvs/Trigger", {})
        self.assertTrue(answered and answer["success"] and answer["message"], answer)

    def restart_often(self, count):
        """One after the other over one connection, which stays."""
        self.assertEqual(self.probe.call_often("/restart_simulation", "std_srvs/Trigger", count), count)

    def place(self, robot):
        return self.latest(f"{robot}/truth")

    def stands(self, robot):
        """Whether it is where it was a third of a second ago."""
        before = self.place(robot)
        time.sleep(0.3)
        return math.dist(self.place(robot), before) < STILL

    def expect_at_start(self):
        """Both within a millimetre of where they began; a message from before the restart may still be on its way."""
        for robot, start in (("", [0.0, 0.0]), ("/rto3", [0.0, -1.5])):
            self.until(
                lambda robot=robot, start=start: math.dist(self.place(robot), start) < 0.001, f"{robot} at {start}"
            )

    def wait_for_way(self, robot, way):
        """Wait until the robot has come so far from where it is now [m]; a failure shows what its safety gate says."""
        begin = self.place(robot)
        deadline = time.monotonic() + DRIVE_PATIENCE
        while math.dist(self.place(robot), begin) < way:
            state = self.newest(f"{robot}/safety_state")
            self.assertLess(time.monotonic(), deadline, f"it does not drive: {state}")

    def memory(self):
        """What the simulator holds of the machine's memory [MB]."""
        pages = int(Path(f"/proc/{self.simulator}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6

    def memory_is_steady(self):
        """Cameras and viewer take buffers when they begin."""
        before = self.memory()
        time.sleep(1.0)
        return abs(self.memory() - before) < 1.0

    def viewer_is_open(self):
        """Whether MuJoCo's window is on the simulator's screen."""
        simulators = environment_of(self.simulator)
        display = {**os.environ, **{name: simulators[name] for name in ("DISPLAY", "XAUTHORITY")}}
        words = ["xdotool", "search", "--onlyvisible", "--name", "MuJoCo"]
        return bool(subprocess.run(words, env=display, capture_output=True, timeout=20).stdout)


if __name__ == "__main__":
    rostest.rosrun("sim_bringup", "both", Both)
