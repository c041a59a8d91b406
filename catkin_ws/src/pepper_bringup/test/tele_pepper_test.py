#!/usr/bin/env python3
"""The report's command line with the simulated robot: its programs, their topics, types and frames; they come back."""

import os
import signal
import time

import rosnode
import rostest
from telepresence_ros.launch_test import LaunchTest

TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/imu": "sensor_msgs/Imu",
    "/joint_states": "sensor_msgs/JointState",
    "/joint_stiffness": "sensor_msgs/JointState",
    "/drive_state": "std_msgs/String",
    "/tf": "tf2_msgs/TFMessage",
    "/tf_static": "tf2_msgs/TFMessage",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
    "/cmd_vel": "geometry_msgs/Twist",
    "/pepper_robot/sonar/front": "sensor_msgs/Range",
    "/pepper_robot/sonar/back": "sensor_msgs/Range",
    "/pepper_robot/laser": "sensor_msgs/LaserScan",
    "/pepper_robot/laser/srd_front/scan": "sensor_msgs/LaserScan",
    "/pepper_robot/laser/srd_left/pointcloud": "sensor_msgs/PointCloud2",
    "/pepper_robot/camera/front/image_raw": "sensor_msgs/Image",
    "/pepper_robot/camera/front/camera_info": "sensor_msgs/CameraInfo",
    "/pepper_robot/camera/bottom/image_raw": "sensor_msgs/Image",
    "/pepper_robot/camera/depth/image_raw": "sensor_msgs/Image",
    "/pepper_robot/imu/torso": "sensor_msgs/Imu",
    "/pepper_robot/imu/base": "sensor_msgs/Imu",
    "/pepper_robot/info": "naoqi_bridge_msgs/StringStamped",
    "/pepper_robot/bumper": "naoqi_bridge_msgs/Bumper",
    "/pepper_robot/battery": "sensor_msgs/BatteryState",
}
FRAMES = [
    "base_footprint",
    "l_wrist",
    "LFinger13_link",
    "WheelB_link",
    "CameraTop_optical_frame",
    "SonarFront_frame",
    "SurroundingLeftLaser_frame",
]
STOP_WITHIN = 1.0 + 0.1
"""Same limit as in the driver's own tests [s]."""


class TelePepper(LaunchTest):
    nodes = (
        "/pepper_publisher",
        "/naoqi_driver",
        "/naoqi_joint_states",
        "/pepper_robot/pepper_sonar",
        "/pepper_robot/pepper_laser",
        "/pepper_robot/pose/pose_manager",
        "/pepper_robot/pose/pose_controller",
        "/pepper_robot/camera/front",
        "/pepper_robot/camera/bottom",
        "/pepper_robot/camera/depth",
        "/com_cam",
        "/voice",
        "/drive_lease",
        "/teleop_twist_keyboard",
    )

    def prepare(self):
        self.probe.watch("/odom", "nav_msgs/Odometry", ["twist.twist.linear.x"])

    def test_topics_have_their_types(self):
        self.expect_topics(TOPICS)
        self.assertIn("<robot", self.probe.parameter("/robot_description"))

    def test_joint_angles_of_the_driver_in_cpp_move_the_head(self):
        self.probe.watch("/joint_states", "sensor_msgs/JointState", ["name", "position"])
        self.start(
            *("rostopic", "pub", "-r", "5", "/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed"),
            "{joint_names: [HeadYaw], joint_angles: [0.4], speed: 0.2}",
        )

        def yaw():
            names, positions = self.latest("/joint_states")
            return positions[names.index("HeadYaw")]

        self.until(lambda: abs(yaw() - 0.4) < 0.05, "the head turns")

    def test_every_frame_hangs_below_odom(self):
        for frame in FRAMES:
            self.until(lambda frame=frame: self.probe.transform("odom", frame), f"a transform from odom to {frame}")

    def test_footprint_is_on_the_floor(self):
        *_, z = self.until(lambda: self.probe.transform("odom", "base_footprint"), "the transform")
        self.assertAlmostEqual(z, 0.0, delta=0.01)

    def test_the_robots_picture_arrives(self):
        self.probe.watch("/pepper_robot/camera/front/image_raw", "sensor_msgs/Image", ["width", "height", "encoding"])
        self.assertEqual(self.latest("/pepper_robot/camera/front/image_raw"), [640, 480, "rgb8"])

    def test_the_pilot_is_on_the_tablet(self):
        self.probe.watch("/com_cam/status", "diagnostic_msgs/DiagnosticStatus", ["message"])
        self.until(lambda: self.latest("/com_cam/status") == ["Live; on the tablet"], "the status says so")

    def test_killed_driver_is_stopped_and_comes_back(self):
        """The best of a few tries, as other programs hold up those of a busy machine."""
        tries = []
        while not any(seconds < STOP_WITHIN for seconds in tries):
            self.assertLess(len(tries), 4, f"it stands {tries} s after the kill")
            self.cruise()
            victim = self.probe.pid("/naoqi_driver")
            os.kill(victim, signal.SIGKILL)
            killed = time.time()
            self.probe.silence()
            tries.append(self.until(lambda killed=killed: self.stood_after(killed), "the robot stands") - killed)
            self.cruise()
            self.assertNotEqual(self.probe.pid("/naoqi_driver"), victim)
            self.probe.silence()

    def cruise(self):
        self.until(self.driver_listens, "the driver listens")
        self.probe.drive(0.2, 0.0, 0.0)
        self.until(lambda: abs(self.latest("/odom")[0] - 0.2) < 0.01, "the robot drives")

    def driver_listens(self):
        """A master remembers for a while a driver that was killed; the connections do not."""
        try:
            return self.probe.subscribers() >= 1 and self.probe.pid("/naoqi_driver")
        except (OSError, rosnode.ROSNodeException):
            return False

    def stood_after(self, moment):
        """When the odometry, after this moment, showed no more speed [s since 1970]."""
        return next((at for at, value in self.probe.seen("/odom") if at > moment and abs(value[0]) < 0.005), None)


if __name__ == "__main__":
    rostest.rosrun("pepper_bringup", "tele_pepper", TelePepper)
