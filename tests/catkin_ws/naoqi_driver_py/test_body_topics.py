"""Where the robot is and how it feels, on ROS topics, with the simulated robot."""

from __future__ import annotations

import math
import sys
import xmlrpc.client
from pathlib import Path

import pytest
import qi
from naoqi_driver.condition import INFO_KEYS

pytestmark = pytest.mark.ros

PROGRAMS = Path(__file__).parent / "programs"
IMUS = {"/imu": "base_link", "/imu/torso": "base_link", "/imu/base": "base_footprint"}
"""Topic -> frame."""


@pytest.fixture(scope="module")
def naoqi_session(graph):
    """Another client of the robot."""
    graph.start_robot()
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{graph.robot_port}")
    yield session
    session.close()


@pytest.fixture(scope="module")
def probe(graph, naoqi_session):
    address = ("--pip", "127.0.0.1", "--pport", str(graph.robot_port))
    graph.run("rosrun", "naoqi_driver_py", "naoqi_driver.py", *address, "_namespace:=/")
    graph.run_node("naoqi_driver_py", "naoqi_logger.py", "_level:=info")
    probe = graph.probe()
    probe.watch("/joint_states", "sensor_msgs/JointState", ["name", "position", "velocity", "header.stamp"])
    probe.watch("/joint_stiffness", "sensor_msgs/JointState", ["name", "effort"])
    probe.watch(
        "/odom",
        "nav_msgs/Odometry",
        ["header.frame_id", "child_frame_id", "pose.pose.position.z", "pose.covariance", "twist.covariance"],
    )
    accelerations = [f"linear_acceleration.{axis}" for axis in "xyz"]
    for topic in IMUS:
        probe.watch(topic, "sensor_msgs/Imu", ["header.frame_id", *accelerations, "orientation_covariance.0"])
    probe.watch("/info", "naoqi_bridge_msgs/StringStamped", ["data"])
    probe.watch(
        "/tf",
        "tf2_msgs/TFMessage",
        ["transforms.0.header.frame_id", "transforms.0.child_frame_id", "transforms.0.transform.translation.z"],
    )
    probe.watch("/bumper", "naoqi_bridge_msgs/Bumper", ["bumper", "state"])
    probe.watch("/rosout", "rosgraph_msgs/Log", ["msg"])
    probe.watch("/battery", "sensor_msgs/BatteryState", ["percentage", "temperature"])
    return probe


def test_all_joints_are_told_in_the_robots_order(probe):
    names, positions, velocities, _ = probe.latest("/joint_states")
    assert names[:3] == ["HeadYaw", "HeadPitch", "LShoulderPitch"]
    assert len(names) == 17 + 3
    assert names[17:] == ["WheelFL", "WheelB", "WheelFR"]
    assert all(map(math.isfinite, positions))
    assert len(velocities) == len(names)


def test_joint_states_come_25_times_a_second(probe, wait_until):
    probe.forget("/joint_states")

    def rate() -> float:
        """Of the last second; a busy machine has slow ones, too. [1/s]"""
        (first, _), *_, (last, _) = probe.seen("/joint_states")[-26:]
        return 25 / (last - first)

    wait_until(lambda: len(probe.seen("/joint_states")) > 25, "enough readings")
    wait_until(lambda: rate() == pytest.approx(25, rel=0.1), "25 readings in a second")
    (first, _), *_, (last, _) = probe.seen("/joint_states")
    assert (len(probe.seen("/joint_states")) - 1) / (last - first) < 1.1 * 25, "and never more"


def test_stiffness_of_an_awake_robot(probe):
    names, effort = probe.latest("/joint_stiffness")
    assert dict(zip(names, effort, strict=True))["KneePitch"] == 1.0


def test_odometry_places_the_torso(probe):
    frame, child, z, *_ = probe.latest("/odom")
    assert (frame, child) == ("odom", "base_link")
    assert z == pytest.approx(0.82, abs=0.01)  # docs: torso origin 0.820 m above the floor


def test_odometry_does_not_claim_to_be_exact(probe):
    """Zeros would."""
    for covariance in probe.latest("/odom")[3:]:
        assert min(covariance[::7]) > 0.0, "the diagonal"


def test_transform_leads_from_odom_to_the_torso(probe):
    assert probe.latest("/tf") == ["odom", "base_link", pytest.approx(0.82, abs=0.01)]


@pytest.mark.parametrize("topic", IMUS)
def test_imu_feels_gravity(probe, topic):
    frame, x, y, z, known = probe.latest(topic)
    assert frame == IMUS[topic]
    assert math.sqrt(x * x + y * y + z * z) == pytest.approx(9.81, abs=0.5)
    assert known == 0.0


def test_the_robot_says_what_it_is(probe):
    assert " ; RobotConfig/Body/Type: Juliette ; " in probe.newest("/info")[0]


def test_battery_is_told(probe):
    charge, temperature = probe.latest("/battery")
    assert 0.0 < charge <= 1.0
    assert math.isnan(temperature), "nothing is known about it, as sensor_msgs/BatteryState says"


def test_robot_speaks_and_knows_its_language(probe):
    assert probe.call("/naoqi_driver/get_language", "naoqi_bridge_msgs/GetString", {}) == [True, {"data": "English"}]
    assert probe.call("/naoqi_driver/set_language", "naoqi_bridge_msgs/SetString", {"data": "Klingon"})[1] == {
        "success": False
    }


def test_speech_topic_reaches_the_robot(graph, naoqi_session, probe, wait_until):
    memory = naoqi_session.service("ALMemory")
    with xmlrpc.client.ServerProxy(graph.uri) as master:  # what was latched before somebody listened is past
        wait_until(lambda: "/speech" in dict(master.getSystemState("/tests")[2][1]), "somebody listens")
    graph.run("rostopic", "pub", "-1", "/speech", "std_msgs/String", "good morning")
    wait_until(
        lambda: memory.getListData(["ALTextToSpeech/CurrentSentence"]) == ["good morning"],
        "the robot says the sentence",
    )


def test_a_program_speaks_by_the_action_of_naoqi_bridge_msgs(graph, naoqi_session, probe):
    greeting = graph.run(sys.executable, str(PROGRAMS / "greet.py"), "Hello.")
    assert greeting.wait_for(r"begun: .*")[0] == "begun: True finished: True state: 3", "3 is SUCCEEDED"


def test_bumpers_that_nothing_touches_are_silent(naoqi_session, probe):
    assert naoqi_session.service("ALMemory").getData("Device/SubDeviceList/Platform/Back/Bumper/Sensor/Value") == 0.0
    assert probe.seen("/bumper") == [], "nothing touches the robot, so nothing is told"


def test_robots_log_appears_on_rosout(naoqi_session, probe, wait_until):
    manager = naoqi_session.service("LogManager")
    message = ("test", 3, "motors", "here", "hot motor", 1, 0, 0)

    def told() -> bool:
        manager.log([message])
        return any("hot motor" in fields[0] for _, fields in probe.seen("/rosout"))

    wait_until(told, "the message appears")


class ReticentMemory:
    """It leaves out what the robot is."""

    def __init__(self) -> None:
        self.asked = 0

    def getListData(self, keys: list[str]) -> list:
        if tuple(keys) != INFO_KEYS:
            return [0.5] * len(keys)
        self.asked += 1
        return []


class Body:
    def getBodyNames(self, group: str) -> list[str]:
        return ["HeadYaw"]


def test_a_robot_that_does_not_say_what_it_is_has_a_battery_and_temperatures(graph, naoqi, probe, wait_until):
    memory = ReticentMemory()
    naoqi.register("ALMemory", memory)
    naoqi.register("ALMotion", Body())
    program = graph.workspace / "lib" / "naoqi_driver_py" / "naoqi_condition.py"
    with graph.run(str(program), "--pip=127.0.0.1", f"--pport={naoqi.port}", "__ns:=/reticent") as node:
        probe.watch("/reticent/battery", "sensor_msgs/BatteryState", ["percentage"])
        assert probe.newest("/reticent/battery") == [0.5]
        node.wait_for("the robot does not say what it is: info: list of 0 for 15 values")
        asked = memory.asked
        wait_until(lambda: memory.asked >= asked + 2, "it is asked again")
        assert node.output.count("does not say what it is") == 1
