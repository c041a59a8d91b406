"""Pepper and Robotino in one world on one master: `launch/both.launch`."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import pytest

from telepresence.station import processes
from telepresence.station.virtual_display import VirtualDisplay

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

LAUNCH = Path(__file__).resolve().parents[3] / "launch" / "both.launch"
EXAMPLE = LAUNCH.parents[1] / "catkin_ws" / "src" / "sim_bringup" / "examples" / "custom_controller.py"
DRIVE_PATIENCE = 40.0
"""Seconds that a robot has to get somewhere, on a machine that is busy."""
STILL = 0.002
"""A robot that nobody drives moves less than this [m]."""


class Both:
    def __init__(self, graph) -> None:
        self.graph = graph
        settings = {
            "gui": "false",
            "teleop": "false",
            "scene": "empty",
            "viewer": "true",
            "source": "test",
            "nao_port": graph.robot_port,
            "robotino_port": graph.free_port(),
            "page_port": graph.free_port(),
            "drive_port": graph.free_port(),
            "camera_port": graph.free_port(),
            "sound_port": graph.free_port(),
        }
        self.sound_port = settings["sound_port"]
        self.launch = graph.run("roslaunch", str(LAUNCH), *(f"{name}:={value}" for name, value in settings.items()))
        self.probe = graph.probe()
        for robot in ("", "/rto3"):
            self.probe.watch(f"{robot}/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
            self.probe.watch(f"{robot}/safety_state", "std_msgs/String", ["data"])

    @property
    def memory(self) -> float:
        """What the simulator holds of the machine's memory [MB]."""
        for pid in processes.descendants(self.launch.process.pid):
            if b"world_sim" in Path(f"/proc/{pid}/cmdline").read_bytes():
                pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
                return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
        pytest.fail("the simulator does not run")

    def memory_is_steady(self) -> bool:
        """Cameras and viewer take buffers when they begin."""
        before = self.memory
        threading.Event().wait(1.0)
        return abs(self.memory - before) < 1.0

    @property
    def viewer_is_open(self) -> bool:
        """Whether MuJoCo's window is on the screen."""
        words = ["xdotool", "search", "--onlyvisible", "--name", "MuJoCo"]
        return bool(subprocess.run(words, env=self.graph.environment, capture_output=True, timeout=20).stdout)

    def restart(self, service: str = "/restart_simulation") -> None:
        answer = self.probe.call(service, "std_srvs/Trigger", {})
        assert answer[0] is True and answer[1]["success"] is True and answer[1]["message"]

    def restart_often(self, count: int) -> None:
        """One after the other over one connection, which stays."""
        assert self.probe.call_often("/restart_simulation", "std_srvs/Trigger", count) == count

    def place(self, topic: str) -> list[float]:
        return self.probe.latest(topic)

    def expect_at_start(self, until_true) -> None:
        """Both within a millimetre of where they began; a message from before the restart may still be on its way."""
        for topic, start in (("/truth", [0.0, 0.0]), ("/rto3/truth", [0.0, -1.5])):
            until_true(lambda topic=topic, start=start: math.dist(self.place(topic), start) < 0.001, f"{topic} {start}")

    def stands(self, robot: str) -> bool:
        """Whether it is where it was a third of a second ago."""
        before = self.place(f"{robot}/truth")
        threading.Event().wait(0.3)
        return math.dist(self.place(f"{robot}/truth"), before) < STILL

    def wait_for_way(self, robot: str, way: float) -> None:
        """Wait until the robot has come so far from where it is now [m]; a failure shows what its safety gate says."""
        begin = self.place(f"{robot}/truth")
        deadline = time.monotonic() + DRIVE_PATIENCE
        while math.dist(self.place(f"{robot}/truth"), begin) < way:
            assert time.monotonic() < deadline, f"it does not drive: {self.probe.newest(f'{robot}/safety_state')}"

    def order(self, topic: str, movement: int):
        """Somebody who gives one movement command and stays."""
        return self.graph.run("rostopic", "pub", topic, "std_msgs/Int32", str(movement))


@pytest.fixture(scope="module")
def both(graph):
    display = VirtualDisplay(320, 240)
    graph.environment["DISPLAY"] = display.name
    made = Both(graph)
    yield made
    made.launch.end()
    display.close()


def test_all_programs_of_both_are_on_one_master(both, until_true):
    expected = {
        "/robot_control_node",
        "/naoqi_driver",
        "/pepper_robot/pepper_laser",
        "/pepper_robot/camera/front",
        "/rto3/rto_core",
        "/rto3/rto_odometry",
        "/rto3/rto_drive_link",
        "/voice",
        "/rto3/rto_voice",
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
        "/voice/levels": "std_msgs/Float32MultiArray",
        "/rto3/voice/levels": "std_msgs/Float32MultiArray",
    }
    until_true(lambda: wanted.items() <= both.probe.topics().items(), "the topics of both robots")


@pytest.mark.parametrize(("driven", "other"), [("", "/rto3"), ("/rto3", "")], ids=["pepper drives", "robotino drives"])
def test_each_drives_alone(both, until_true, driven, other):
    """Through safety gate, driver and wire of the one; the other stands."""
    stands = both.place(f"{other}/truth")
    pilot = both.order(f"{driven}/movement_command", 1)
    both.wait_for_way(driven, 0.15)
    pilot.end()
    until_true(lambda: both.stands(driven), "it stops when whoever commanded is gone")
    assert math.dist(both.place(f"{other}/truth"), stands) < STILL


def test_the_pilot_is_connected_with_the_sound_of_both(both, until_true):
    """Here without a sound card, which both say; the links stand."""
    url = f"http://127.0.0.1:{both.sound_port}/sound"
    until_true(lambda: json.load(urllib.request.urlopen(url, timeout=10))["pilots"] == 1, "the pilot is at Robotino")
    for namespace in ("", "/rto3"):
        answered, answer = both.probe.call(f"{namespace}/voice/talk", "std_srvs/SetBool", {"data": False})
        assert answered and answer["success"] and "not connected" not in answer["message"], answer


def test_commands_that_mean_nothing_stop_the_robot(both, until_true):
    both.restart()
    both.probe.order("/rto3/movement_command", 1)
    both.wait_for_way("/rto3", 0.05)
    both.probe.order("/rto3/movement_command", 7)
    both.launch.wait_for("movement_command 7 means nothing")
    until_true(lambda: both.stands("/rto3"), "it stops")
    stands = both.place("/rto3/truth")
    stranger = both.graph.run("rostopic", "pub", "-r", "20", "/rto3/movement_command", "std_msgs/String", "1")
    until_true(lambda: "/rostopic" in " ".join(both.probe.nodes()), "the wrong type is published")
    for _ in range(10):
        assert math.dist(both.place("/rto3/truth"), stands) < STILL
    stranger.kill()


def test_a_flood_of_commands_is_coalesced(both, until_true):
    """A thousand a second; the robot follows, its driver receives few of them, and it stops when they cease."""
    both.restart()
    both.probe.watch("/rto3/safe_cmd_vel", "geometry_msgs/Twist", ["linear.x"])
    code = (
        "import rospy; from std_msgs.msg import Int32; rospy.init_node('flood');"
        "p = rospy.Publisher('/rto3/movement_command', Int32, queue_size=10); r = rospy.Rate(1000)\n"
        "while not rospy.is_shutdown(): p.publish(1); r.sleep()"
    )
    flood = both.graph.run(sys.executable, "-c", code)
    both.wait_for_way("/rto3", 0.2)
    heard = [when for when, _ in both.probe.seen("/rto3/safe_cmd_vel")]
    assert len(heard) < 10 + 60 * (heard[-1] - heard[0]), "the driver is told at most fifty times a second"
    flood.kill()
    until_true(lambda: both.stands("/rto3"), "it stops")


def test_the_example_of_an_own_controller_runs_as_it_is_written(both):
    both.restart()
    program = subprocess.run(
        [sys.executable, str(EXAMPLE), "__ns:=/rto3", "_distance:=0.1", "_timeout:=40"],
        env=both.graph.environment,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert program.returncode == 0, program.stdout + program.stderr
    assert "m forward; now back" in program.stdout and "back where it began" in program.stdout
    # It decides ten times a second at 0.2 m/s, and on a busy machine late.
    assert both.place("/rto3/truth")[0] == pytest.approx(0.0, abs=0.25)


def test_pictures_of_both_come_through_their_own_wires(both):
    for robot in ("", "/rto3"):
        topic = f"{robot}/robot_camera"
        both.probe.watch(topic, "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
        assert both.probe.latest(topic) == [640, 480, "rgb8", "robot_camera"]


def test_one_restart_puts_both_back(both, until_true):
    both.restart("/rto3/restart_simulation")
    both.expect_at_start(until_true)


def test_two_hundred_restarts_under_load(both, until_true):
    """The viewer is open, both cameras are drawn, and both robots driven; memory stays flat and everybody connected."""
    assert both.viewer_is_open
    both.probe.order("/rto3/movement_command", 1)
    both.restart_often(20)
    until_true(both.memory_is_steady, "the cameras have what they need")
    before = both.memory
    both.probe.drive(0.2, 0.0, 0.3)
    both.restart_often(90)
    both.probe.silence()
    both.restart_often(90)
    assert both.viewer_is_open
    assert both.memory < before + 15.0, "the simulator grows"
    both.expect_at_start(until_true)
    for robot in ("", "/rto3"):
        assert both.probe.latest(f"{robot}/robot_camera")[:2] == [640, 480], "pictures go on"
    both.probe.order("/movement_command", 2)
    both.wait_for_way("", 0.05)
    both.probe.order("/movement_command", 0)
    assert "restarting process" not in both.launch.output, "nothing died"
