"""The whole pilot's side of a Robotino on a private graph, against the simulated robot in a process of its own."""

from __future__ import annotations

import math
import re
import signal
import sys

import pytest
import yaml

pytestmark = pytest.mark.ros

STANDING = 0.005


class Station:
    def __init__(self, graph) -> None:
        self.graph = graph
        self.port = graph.free_port()
        self.start_robot()
        self.launch = graph.run(
            "roslaunch", "rto_bringup", "rto.launch", f"hostname:=127.0.0.1:{self.port}", "layer:=gate"
        )
        self.probe = graph.probe()
        self.watch()

    def watch(self) -> None:
        position = ["pose.pose.position.x", "pose.pose.position.y", "twist.twist.linear.x"]
        self.probe.watch("/rto3/odom", "nav_msgs/Odometry", [*position, "header.frame_id", "child_frame_id"])
        self.probe.watch("/rto3/drive_state", "std_msgs/String", ["data"])
        self.probe.watch("/rto3/safety_state", "std_msgs/String", ["data"])
        self.probe.watch("/rto3/bumper", "std_msgs/Bool", ["data"])

    def start_robot(self) -> None:
        self.robot = self.graph.run(sys.executable, "-m", "robotino_sim", "--port", str(self.port), "--scene", "empty")
        self.robot.wait_for("listening on")

    def pilot(self, vx, vy=0.0, wz=0.0, topic="/rto3/safe_cmd_vel"):
        """Somebody who drives ten times a second until killed."""
        twist = f"{{linear: {{x: {vx}, y: {vy}}}, angular: {{z: {wz}}}}}"
        return self.graph.run("rostopic", "pub", "-r", "10", topic, "geometry_msgs/Twist", twist)

    def speed(self) -> float:
        return self.probe.latest("/rto3/odom")[2]

    def state(self, topic="/rto3/drive_state") -> str:
        return self.probe.newest(topic)[0]


@pytest.fixture(scope="module")
def station(graph):
    return Station(graph)


@pytest.fixture
def standing(station, until_true):
    """Nobody drives, nothing moves."""
    until_true(lambda: abs(station.speed()) < STANDING, "the robot stands")
    return station


def test_everything_is_published_under_the_guides_names(station, until_true):
    expected = {
        "distance_sensors": "sensor_msgs/PointCloud",
        "distance_sensors_scan": "sensor_msgs/LaserScan",
        "bumper": "std_msgs/Bool",
        "odom": "nav_msgs/Odometry",
        "joint_states": "sensor_msgs/JointState",
        "power_readings": "rto_msgs/PowerReadings",
        "analog_readings": "rto_msgs/AnalogReadings",
        "digital_readings": "rto_msgs/DigitalReadings",
        "image_raw": "sensor_msgs/Image",
        "camera_info": "sensor_msgs/CameraInfo",
        "drive_state": "std_msgs/String",
        "safety_state": "std_msgs/String",
    }
    wanted = {f"/rto3/{name}": kind for name, kind in expected.items()}
    until_true(lambda: wanted.items() <= station.probe.topics().items(), "all topics")


def test_readings_have_the_guides_and_the_true_geometry(station, until_true):
    probe = station.probe
    probe.watch("/rto3/distance_sensors", "sensor_msgs/PointCloud", ["len(points)", "header.frame_id"])
    probe.watch("/rto3/distance_sensors_scan", "sensor_msgs/LaserScan", ["angle_min", "angle_max", "range_max"])
    probe.watch("/rto3/joint_states", "sensor_msgs/JointState", ["name"])
    probe.watch("/rto3/power_readings", "rto_msgs/PowerReadings", ["voltage"])
    probe.watch("/rto3/image_raw", "sensor_msgs/Image", ["width", "encoding", "header.frame_id"])
    assert probe.latest("/rto3/distance_sensors") == [9, "base_link"]
    assert probe.latest("/rto3/distance_sensors_scan") == pytest.approx(
        [math.radians(-160), math.radians(160), 0.6364], abs=1e-4
    )
    assert probe.latest("/rto3/joint_states")[0] == ["wheel0_joint", "wheel1_joint", "wheel2_joint"]
    assert 15.0 < probe.newest("/rto3/power_readings")[0] < 30.0
    assert probe.latest("/rto3/image_raw") == [320, "bgr8", "camera_optical_frame"]
    assert probe.newest("/rto3/odom")[3:] == ["odom", "base_link"]
    until_true(lambda: probe.transform("odom", "infrared0_link"), "the body hangs on odom")


def test_the_guides_commands_print_what_it_shows(station, until_true):
    """The Robotino guide's `ros2 topic info`, `ros2 interface show` and `ros2 topic echo`, in ROS 1's spelling."""
    commands = {
        "info": ("rostopic", "info", "/rto3/distance_sensors"),
        "show": ("rosmsg", "show", "sensor_msgs/PointCloud"),
        "echo": ("rostopic", "echo", "-n", "1", "/rto3/distance_sensors"),
    }
    programs = {name: station.graph.run(*argv) for name, argv in commands.items()}
    until_true(lambda: all(each.process.poll() == 0 for each in programs.values()), "they print and end")
    info, show, echo = (programs[name].output for name in commands)
    assert info.startswith("Type: sensor_msgs/PointCloud\n")
    assert re.search(r"Publishers: \n \* /rto3/rto_core ", info)
    assert re.search(r"Subscribers: \n(.*\n)* ?\* /rto3/safe_omni_drive ", info)
    for line in ("std_msgs/Header header", "geometry_msgs/Point32[] points", "sensor_msgs/ChannelFloat32[] channels"):
        assert f"{line}\n" in show
    cloud = yaml.safe_load(echo.partition("\n---")[0])
    assert cloud["header"]["frame_id"] == "base_link" and len(cloud["points"]) == 9
    for number, (point, distance) in enumerate(zip(cloud["points"], cloud["channels"][0]["values"], strict=True)):
        expected = [(distance + 0.2) * math.cos(0.698 * number), (distance + 0.2) * math.sin(0.698 * number), 0.05]
        assert [point["x"], point["y"], point["z"]] == pytest.approx(expected, abs=1e-4)


def test_drives_through_the_safety_layer_and_stops_when_commands_cease(standing, until_true):
    pilot = standing.pilot(0.2)
    until_true(lambda: standing.speed() > 0.15, "the robot drives")
    assert standing.state() == "driving"
    pilot.kill()
    until_true(lambda: abs(standing.speed()) < STANDING, "the robot stands")
    until_true(lambda: standing.state().startswith("stopped"), "the driver says so")


def test_stops_before_a_wall_and_says_why(standing, until_true):
    """The robot starts 1.5 m from the wall on its right."""
    pilot = standing.pilot(0.0, -0.2)
    until_true(lambda: standing.state("/rto3/safety_state").startswith("blocked"), "the gate blocks")
    assert "obstacle" in standing.state("/rto3/safety_state")
    assert not standing.probe.latest("/rto3/bumper")[0]
    assert standing.probe.latest("/rto3/odom")[1] == pytest.approx(-1.2, abs=0.12)
    pilot.kill()


def test_refuses_nonsense(standing, until_true):
    pilot = standing.pilot(".nan", topic="/rto3/cmd_vel")
    until_true(lambda: "refused" in standing.state(), "the driver refuses")
    assert abs(standing.speed()) < STANDING
    pilot.kill()


def test_odometry_is_reset_on_our_side(standing):
    answer = standing.probe.call("/rto3/reset_odometry", "rto_msgs/ResetOdometry", {"x": 1.0, "y": 2.0, "phi": 0.5})
    assert answer[0] is True
    assert standing.probe.latest("/rto3/odom")[:2] == pytest.approx([1.0, 2.0], abs=0.02)


def test_robot_that_goes_away_and_comes_back(standing, until_true):
    standing.robot.kill()
    until_true(lambda: "unreachable" in standing.state(), "the driver says that the robot is gone")
    assert str(standing.port) in standing.state()
    standing.start_robot()
    until_true(lambda: standing.state().startswith("stopped"), "the driver has the robot back")
    pilot = standing.pilot(0.0, 0.1)
    until_true(lambda: standing.probe.latest("/rto3/odom")[1] > 2.1, "the robot drives again, odometry goes on")
    pilot.kill()


def test_master_that_dies_and_comes_back(standing, until_true):
    pilot = standing.pilot(0.0, 0.15)
    until_true(lambda: standing.state() == "driving", "the robot drives")
    standing.graph.master.kill()
    standing.launch.wait_for("stopped: the ROS master does not answer")
    pilot.kill()
    standing.graph.start_master()
    standing.probe = standing.graph.probe()
    standing.watch()
    until_true(lambda: standing.state().startswith("stopped"), "the driver is registered again")
    pilot = standing.pilot(0.0, 0.1)
    until_true(lambda: standing.state() == "driving", "the robot drives again")
    pilot.signal(signal.SIGTERM)
