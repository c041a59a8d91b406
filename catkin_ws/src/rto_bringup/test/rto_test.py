#!/usr/bin/env python3
"""The whole pilot's side of a Robotino against the simulated robot, which dies and comes back."""

import math
import os
import signal
import subprocess
from pathlib import Path

import rostest
import yaml
from telepresence_ros.launch_test import LaunchTest

STANDING = 0.005
"""Slower than this the robot stands [m/s]."""
TOPICS = {
    "/rto3/distance_sensors": "sensor_msgs/PointCloud",
    "/rto3/distance_sensors_scan": "sensor_msgs/LaserScan",
    "/rto3/bumper": "std_msgs/Bool",
    "/rto3/odom": "nav_msgs/Odometry",
    "/rto3/joint_states": "sensor_msgs/JointState",
    "/rto3/power_readings": "rto_msgs/PowerReadings",
    "/rto3/analog_readings": "rto_msgs/AnalogReadings",
    "/rto3/digital_readings": "rto_msgs/DigitalReadings",
    "/rto3/motor_readings": "rto_msgs/MotorReadings",
    "/rto3/rto_joint_states": "sensor_msgs/JointState",
    "/rto3/distance_sensors_clearing": "sensor_msgs/PointCloud",
    "/rto3/image_raw": "sensor_msgs/Image",
    "/rto3/camera_info": "sensor_msgs/CameraInfo",
    "/rto3/drive_state": "std_msgs/String",
    "/rto3/safety_state": "std_msgs/String",
}
RVIZ = Path(__file__).resolve().parents[1] / "config" / "rto.rviz"
SHOWN = {
    "rviz/Odometry": "nav_msgs/Odometry",
    "rviz/MarkerArray": "visualization_msgs/MarkerArray",
    "rviz/LaserScan": "sensor_msgs/LaserScan",
    "rviz/PointCloud": "sensor_msgs/PointCloud",
    "rviz/Image": "sensor_msgs/Image",
}
"""What RViz's displays subscribe to."""


class Rto(LaunchTest):
    nodes = (
        "/robot_control_node",
        "/rto3/rto_core",
        "/rto3/rto_odometry",
        "/rto3/rto_camera",
        "/rto3/rto_camera_receiver",
        "/rto3/safe_omni_drive",
        "/rto3/drive_lease",
    )

    def prepare(self):
        pose = ["pose.pose.position.x", "pose.pose.position.y", "twist.twist.linear.x"]
        self.probe.watch("/rto3/odom", "nav_msgs/Odometry", [*pose, "header.frame_id", "child_frame_id"])
        self.probe.watch("/rto3/drive_state", "std_msgs/String", ["data"])
        self.until(lambda: self.state().startswith("stopped"), "the driver has the robot")

    def setUp(self):
        super().setUp()
        self.until(self.stands, "the robot stands")

    def test_everything_is_published_under_the_guides_names(self):
        self.expect_topics(TOPICS)

    def test_what_rviz_is_to_show_is_published(self):
        displays = yaml.safe_load(RVIZ.read_text())["Visualization Manager"]["Displays"]
        topics = {
            f"/rto3/{topic}": SHOWN[display["Class"]]
            for display in displays
            for key, topic in display.items()
            if key.endswith("Topic")
        }
        self.assertEqual(
            {display["Class"] for display in displays} - {"rviz/Grid", "rviz/TF", "rviz/RobotModel"}, {*SHOWN}
        )
        self.assertEqual(topics.pop("/rto3/scan"), "sensor_msgs/LaserScan")  # this robot carries no laser
        self.expect_topics(topics)

    def test_readings_have_the_guides_and_the_true_geometry(self):
        probe = self.probe
        probe.watch("/rto3/distance_sensors", "sensor_msgs/PointCloud", ["len(points)", "header.frame_id"])
        probe.watch("/rto3/distance_sensors_scan", "sensor_msgs/LaserScan", ["angle_min", "angle_max", "range_max"])
        probe.watch("/rto3/joint_states", "sensor_msgs/JointState", ["name"])
        probe.watch("/rto3/power_readings", "rto_msgs/PowerReadings", ["voltage"])
        probe.watch("/rto3/image_raw", "sensor_msgs/Image", ["width", "encoding", "header.frame_id"])
        self.assertEqual(self.latest("/rto3/distance_sensors"), [9, "base_link"])
        measured = self.latest("/rto3/distance_sensors_scan")
        for value, wanted in zip(measured, [math.radians(-160), math.radians(160), 0.6364], strict=True):
            self.assertAlmostEqual(value, wanted, delta=1e-4)
        self.assertEqual(self.latest("/rto3/joint_states")[0], ["wheel0_joint", "wheel1_joint", "wheel2_joint"])
        self.assertTrue(15.0 < self.newest("/rto3/power_readings")[0] < 30.0)
        self.assertEqual(self.latest("/rto3/image_raw"), [320, "bgr8", "camera_optical_frame"])
        self.assertEqual(self.newest("/rto3/odom")[3:], ["odom", "base_link"])
        self.until(lambda: probe.transform("odom", "infrared0_link"), "the body hangs on odom")

    def test_programs_for_rto_core_get_what_they_subscribe_to(self):
        probe = self.probe
        joints, motors, clearing = (
            f"/rto3/{name}" for name in ("rto_joint_states", "motor_readings", "distance_sensors_clearing")
        )
        probe.watch(joints, "sensor_msgs/JointState", ["name", "velocity", "header.stamp"])
        probe.watch(motors, "rto_msgs/MotorReadings", ["velocities", "stamp"])
        probe.watch(clearing, "sensor_msgs/PointCloud", ["len(points)", "points.0.x", "header.frame_id"])
        self.assertEqual(self.latest(joints)[0], ["wheel2_joint", "wheel0_joint", "wheel1_joint"])
        points, ahead, frame = self.latest(clearing)
        self.assertEqual((points, frame), (1, "base_link"))
        self.assertAlmostEqual(ahead, 5.0, delta=0.01)
        pilot = self.pilot(0.2)

        def together():
            """Motors that turn [rpm], and the wheels [rad/s] of the same moment, in the order of their names above."""
            wheels = {stamp: velocity for _, (_, velocity, stamp) in probe.seen(joints)}
            readings = [(rpm, wheels[stamp]) for _, (rpm, stamp) in probe.seen(motors) if stamp in wheels]
            return [(rpm, speeds) for rpm, speeds in readings if rpm[2] > 500.0]

        rpm, speeds = self.until(together, "a front wheel's motor turns")[0]
        for motor, speed in zip((rpm[2], rpm[0], rpm[1]), speeds, strict=True):
            self.assertAlmostEqual(motor, speed * 32 * 60 / math.tau, delta=0.1)
        pilot.kill()

    def test_drives_through_the_safety_gate_and_stops_when_commands_cease(self):
        pilot = self.pilot(0.2)
        self.until(lambda: self.latest("/rto3/odom")[2] > 0.15, "the robot drives")
        self.until(lambda: self.state() == "driving", "the driver says so")
        pilot.kill()
        self.until(self.stands, "the robot stands")
        self.until(lambda: self.state().startswith("stopped"), "the driver says so")

    def test_refuses_nonsense(self):
        """On the topic of programs that know no gate, which the gate hears, too."""
        self.probe.watch("/rto3/safety_state", "std_msgs/String", ["data"])
        self.pilot(".nan", topic="/rto3/cmd_vel")
        self.until(lambda: "not a number" in self.newest("/rto3/safety_state")[0], "the gate refuses")
        self.assertTrue(self.stands())

    def test_robot_that_goes_away_and_comes_back(self):
        """Odometry is reset on our side, and goes on there when the robot is back."""
        answer = self.probe.call("/rto3/reset_odometry", "rto_msgs/ResetOdometry", {"x": 1.0, "y": 2.0, "phi": 0.5})
        self.assertIs(answer[0], True, answer)
        self.until(lambda: math.dist(self.latest("/rto3/odom")[:2], [1.0, 2.0]) < 0.02, "odometry is reset")
        self.probe.forget("/rto3/drive_state")
        os.kill(self.probe.pid("/robot_control_node"), signal.SIGKILL)

        def gone() -> list[str]:
            """What was said about it, also when the robot is back already."""
            return [state for _, (state,) in self.probe.seen("/rto3/drive_state") if "unreachable" in state]

        self.until(gone, "the driver says that the robot is gone")
        self.assertIn(":8080", gone()[0])
        self.until(lambda: self.state().startswith("stopped"), "the driver has the robot back")
        self.pilot(0.0, 0.1)
        self.until(lambda: self.latest("/rto3/odom")[1] > 2.1, "the robot drives again, odometry goes on")

    def pilot(self, vx, vy=0.0, topic="/rto3/safe_cmd_vel") -> subprocess.Popen:
        """Somebody who drives ten times a second until killed."""
        return self.start(
            *("rostopic", "pub", "-r", "10", topic, "geometry_msgs/Twist", f"{{linear: {{x: {vx}, y: {vy}}}}}"),
            stdout=subprocess.DEVNULL,
        )

    def stands(self):
        return abs(self.latest("/rto3/odom")[2]) < STANDING

    def state(self):
        return self.newest("/rto3/drive_state")[0]


if __name__ == "__main__":
    rostest.rosrun("rto_bringup", "rto", Rto)
