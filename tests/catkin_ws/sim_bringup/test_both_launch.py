"""Pepper and Robotino in one world on one master: `launch/both.launch`."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros

LAUNCH = Path(__file__).resolve().parents[3] / "launch" / "both.launch"
STILL = 0.002
"""A robot that nobody drives moves less than this [m]."""


class Both:
    def __init__(self, graph) -> None:
        self.graph = graph
        settings = {
            "gui": "false",
            "teleop": "false",
            "scene": "empty",
            "source": "test",
            "nao_port": graph.robot_port,
            "robotino_port": graph.free_port(),
            "page_port": graph.free_port(),
        }
        self.launch = graph.run("roslaunch", str(LAUNCH), *(f"{name}:={value}" for name, value in settings.items()))
        self.probe = graph.probe()
        for name in ("/truth", "/rto3/truth"):
            self.probe.watch(name, "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])

    def place(self, topic: str) -> list[float]:
        return self.probe.latest(topic)

    def order(self, topic: str, movement: int):
        """Somebody who gives one movement command and stays."""
        return self.graph.run("rostopic", "pub", topic, "std_msgs/Int32", str(movement))


@pytest.fixture(scope="module")
def both(graph):
    return Both(graph)


def test_all_programs_of_both_are_on_one_master(both, until_true):
    expected = {
        "/robot_control_node",
        "/naoqi_driver",
        "/pepper_robot/pepper_laser",
        "/pepper_robot/camera/front",
        "/rto3/rto_core",
        "/rto3/rto_odometry",
        "/rto3/safe_omni_drive",
    }
    until_true(lambda: expected <= set(both.probe.nodes()), "the nodes of both robots")
    wanted = {
        "/odom": "nav_msgs/Odometry",
        "/rto3/odom": "nav_msgs/Odometry",
        "/body_state": "std_msgs/Float32MultiArray",
        "/rto3/body_state": "std_msgs/Float32MultiArray",
        "/robot_camera": "sensor_msgs/Image",
        "/rto3/robot_camera": "sensor_msgs/Image",
        "/rto3/tf": "tf2_msgs/TFMessage",
    }
    until_true(lambda: wanted.items() <= both.probe.topics().items(), "the topics of both robots")


@pytest.mark.parametrize(
    ("driven", "other"), [("", "/rto3"), ("/rto3", "")], ids=["pepper drives", "robotino drives"]
)
def test_each_drives_alone(both, until_true, driven, other):
    """Through safety layer, driver and wire of the one; the other stands."""
    begin, stands = both.place(f"{driven}/truth"), both.place(f"{other}/truth")
    pilot = both.order(f"{driven}/movement_command", 1)
    until_true(lambda: math.dist(both.place(f"{driven}/truth"), begin) > 0.15, "the robot drives")
    pilot.end()
    until_true(
        lambda: math.dist(both.place(f"{driven}/truth"), both.place(f"{driven}/truth")) < STILL,
        "it stops when whoever commanded is gone",
    )
    assert math.dist(both.place(f"{other}/truth"), stands) < STILL


def test_pictures_of_both_come_through_their_own_wires(both):
    for robot in ("", "/rto3"):
        topic = f"{robot}/robot_camera"
        both.probe.watch(topic, "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
        assert both.probe.latest(topic) == [640, 480, "rgb8", "robot_camera"]


def test_one_restart_puts_both_back(both, until_true):
    answer = both.probe.call("/rto3/restart_simulation", "std_srvs/Trigger", {})
    assert answer[0] is True and answer[1]["success"] is True and answer[1]["message"]
    assert both.place("/truth") == pytest.approx([0.0, 0.0], abs=0.001)
    assert both.place("/rto3/truth") == pytest.approx([0.0, -1.5], abs=0.001)
