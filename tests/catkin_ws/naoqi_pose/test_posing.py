"""Poses, trajectories and stiffness with the simulated robot."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from actionlib_msgs.msg import GoalStatus

from telepresence import naoqi

pytestmark = pytest.mark.ros
PROGRAMS = Path(__file__).parent / "programs"
BASE = """
import rospy
from std_srvs.srv import Empty, EmptyResponse

def stop(_request):
    print("asked to stop", flush=True)
    return EmptyResponse()

rospy.init_node("base")
rospy.Service("/p1/stop_walk_srv", Empty, stop)
rospy.spin()
"""


@pytest.fixture(scope="module")
def probe(graph):
    robot = graph.run(sys.executable, str(PROGRAMS / "stubborn_pepper.py"), "--port", str(graph.robot_port))
    robot.wait_for("listening on")
    graph.run_node("naoqi_driver_py", "naoqi_joint_states.py")
    graph.run_node("naoqi_pose", "pose_controller.py")
    poses = graph.workspace.parent / "src" / "naoqi_pose" / "config" / "pepper_poses.yaml"
    graph.run("rosparam", "load", str(poses), "/pose_manager/poses").process.wait(30)
    graph.run(str(graph.workspace / "lib" / "naoqi_pose" / "pose_manager.py"))
    probe = graph.probe()
    probe.watch("/joint_states", "sensor_msgs/JointState", ["name", "position"])
    probe.watch("/joint_stiffness", "sensor_msgs/JointState", ["name", "effort"])
    probe.watch("/get_life_state", "std_msgs/String", ["data"])
    return probe


def joint(probe, name: str) -> float:
    names, positions = probe.latest("/joint_states")
    return dict(zip(names, positions, strict=True))[name]


def execute(graph, pose: str, *remappings: str):
    program = graph.run(str(graph.workspace / "lib" / "naoqi_pose" / "execute_pose.py"), pose, *remappings)
    return program.process.wait(60), program.output


def test_named_pose_is_taken(graph, probe):
    code, output = execute(graph, "zero")
    assert code == 0, output
    assert joint(probe, "LShoulderPitch") == pytest.approx(0.0245, abs=0.06)


def test_unknown_pose_is_refused_with_the_known_ones(graph, probe):
    code, output = execute(graph, "headstand")
    assert code == 1
    assert "no pose 'headstand'; known: arms_down, crouch, stand, zero" in output


def test_joint_angles_topic_moves_the_head(graph, probe, wait_until):
    graph.run(
        "rostopic", "pub", "-1", "/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed",
        "{joint_names: [HeadYaw], joint_angles: [0.6], speed: 0.2}",
    )  # fmt: skip
    wait_until(lambda: abs(joint(probe, "HeadYaw") - 0.6) < 0.05, "the head turns")


def test_rest_and_wake_up(probe, wait_until):
    def stiffness() -> float:
        names, effort = probe.latest("/joint_stiffness")
        return dict(zip(names, effort, strict=True))["HeadYaw"]

    assert probe.call("/rest", "std_srvs/Empty", {})[0]
    wait_until(lambda: stiffness() == 0.0, "the motors are off")
    assert probe.call("/wakeup", "std_srvs/Empty", {})[0]
    wait_until(lambda: stiffness() > 0.9, "the motors are on")


def test_life_can_be_switched_off(probe, wait_until):
    assert probe.call("/life/disable", "std_srvs/Empty", {})[0]
    assert probe.call("/life/get_state", "std_srvs/Trigger", {}) == [True, {"success": True, "message": "disabled"}]
    wait_until(lambda: probe.latest("/get_life_state") == ["disabled"], "the state is told")


@pytest.fixture
def red_stop(graph, probe, wait_until):
    """Somebody presses the red stop; what drive_lease says meanwhile."""
    words = ("rostopic", "pub", "-r", "10", "/drive/state", "telepresence_msgs/DriveState")
    pressed = []

    def press():
        pressed.append(graph.run(*words, "{stopped_by: anna}"))

    yield press
    for publisher in pressed:
        publisher.end()


def test_the_red_stop_ends_a_motion_and_refuses_the_next(graph, probe, red_stop):
    url = f"tcp://127.0.0.1:{graph.robot_port}"
    pilot = graph.run(sys.executable, str(PROGRAMS / "withdrawn_goal.py"), url, "joint_trajectory", "--wait")
    pilot.wait_for("the robot moves")
    red_stop()
    assert pilot.process.wait(60) == 0, pilot.output
    assert f"state: {GoalStatus.ABORTED} anna has pressed the red stop" in pilot.output
    robot = naoqi.Session()
    robot.connect(url)
    try:
        assert robot.service("ALMotion").getTaskList() == [], "it goes on"
    finally:
        robot.close()
    code, output = execute(graph, "zero")
    assert code == 1 and "anna has pressed the red stop" in output
    before = joint(probe, "HeadYaw")
    asked = graph.run(
        "rostopic", "pub", "-1", "/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed",
        f"{{joint_names: [HeadYaw], joint_angles: [{before - 0.6}], speed: 1.0}}",
    )  # fmt: skip
    asked.process.wait(30)
    assert not probe.call("/wakeup", "std_srvs/Empty", {})[0]
    assert joint(probe, "HeadYaw") == pytest.approx(before, abs=0.05)
    assert probe.call("/body_stiffness/enable", "std_srvs/Empty", {})[0], "nothing moves by that"


@pytest.mark.parametrize(
    "goal",
    [
        "joint_trajectory",
        "joint_trajectory of a chain",
        "joint_stiffness_trajectory",
        "joint_angles_action",
        "body_pose_naoqi",
    ],
)
def test_what_is_withdrawn_ends_on_a_robot_that_cannot_cancel_calls(graph, probe, goal):
    url = f"tcp://127.0.0.1:{graph.robot_port}"
    pilot = graph.run(sys.executable, str(PROGRAMS / "withdrawn_goal.py"), url, goal)
    assert pilot.process.wait(60) == 0, pilot.output
    robot = naoqi.Session()
    robot.connect(url)
    left = robot.service("ALMotion").getTaskList()
    robot.close()
    assert f"state: {GoalStatus.PREEMPTED} withdrawn" in pilot.output
    assert left == [], "it goes on"


def test_the_red_stop_holds_the_joints_of_a_robot_in_a_namespace(graph, probe):
    graph.run("rosparam", "set", "/p1/pepper_is_here", "true").process.wait(30)
    refusal = "joint_angles is not obeyed: anna has pressed the red stop"
    angles = "{joint_names: [HeadYaw], joint_angles: [-0.6], speed: 1.0}"
    with (
        graph.run_node("naoqi_pose", "pose_controller.py", "__ns:=/p1/pepper_robot/pose") as controller,
        graph.run("rostopic", "pub", "-r", "10", "/p1/drive/state", "telepresence_msgs/DriveState", "stopped_by: anna"),
        graph.run(
            "rostopic", "pub", "-r", "10", "/p1/pepper_robot/pose/joint_angles",
            "naoqi_bridge_msgs/JointAnglesWithSpeed", angles,
        ),
    ):  # fmt: skip
        controller.wait_for(refusal)


def test_the_red_stop_holds_the_joints_where_the_namespace_is_said(graph, probe):
    """And not where a mark is that another launch file has left behind."""
    graph.run("rosparam", "set", "/pepper_is_here", "true").process.wait(30)
    angles = "{joint_names: [HeadYaw], joint_angles: [-0.6], speed: 1.0}"
    with (
        graph.run_node("naoqi_pose", "pose_controller.py", "__ns:=/p3/pose", "_robot_namespace:=/p3") as controller,
        graph.run("rostopic", "pub", "-r", "10", "/p3/drive/state", "telepresence_msgs/DriveState", "stopped_by: ben"),
        graph.run(
            "rostopic", "pub", "-r", "10", "/p3/pose/joint_angles", "naoqi_bridge_msgs/JointAnglesWithSpeed", angles
        ),
    ):
        controller.wait_for("joint_angles is not obeyed: ben has pressed the red stop")
    graph.run("rosparam", "delete", "/pepper_is_here").process.wait(30)


def test_a_red_stop_that_nobody_could_press_is_told(graph, probe):
    with graph.run_node("naoqi_pose", "pose_controller.py", "__ns:=/p4/pose", "_robot_namespace:=p4/") as controller:
        controller.wait_for(r"nobody publishes /p4/drive/state\. .*robot_namespace:=/NAME")


def test_a_pose_of_a_robot_in_a_namespace_stops_its_base(graph, probe):
    """Its service is asked for by the name that it has there."""
    graph.run("rosparam", "set", "/p1/pepper_is_here", "true").process.wait(30)
    poses = graph.workspace.parent / "src" / "naoqi_pose" / "config" / "pepper_poses.yaml"
    graph.run("rosparam", "load", str(poses), "/p1/pepper_robot/pose/pose_manager/poses").process.wait(30)
    stopped = graph.run(sys.executable, "-c", BASE)
    space = "__ns:=/p1/pepper_robot/pose"
    with (
        graph.run_node("naoqi_pose", "pose_controller.py", space),
        graph.run(str(graph.workspace / "lib" / "naoqi_pose" / "pose_manager.py"), space),
    ):
        execute(graph, "zero", space)
        stopped.wait_for("asked to stop")
