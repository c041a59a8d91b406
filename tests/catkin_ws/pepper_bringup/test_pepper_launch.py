"""What the launch files of a Pepper tell its nodes."""

from __future__ import annotations

import pytest
import yaml


@pytest.mark.parametrize(("space", "mark"), [("", "/pepper_is_here"), ("p1", "/p1/pepper_is_here")])
def test_the_poses_find_the_robot_in_its_namespace(roslaunch_says, space, mark):
    parameters = yaml.safe_load(
        roslaunch_says("--dump-params", "pepper_bringup", "pepper_full_py.launch", ROS_NAMESPACE=space)
    )
    assert parameters[mark] is True
    for node in ("pose_controller", "pose_manager"):
        command = roslaunch_says(
            "--args", f"{space and '/'}{space}/pepper_robot/pose/{node}", "pepper_bringup", "pepper_full_py.launch",
            ROS_NAMESPACE=space,
        )  # fmt: skip
        assert "drive/state:=" not in command and "stop_walk_srv:=" not in command, "it asks for its own robot's"


@pytest.mark.parametrize(("words", "said"), [((), ""), (("robot_namespace:=/p1",), "/p1")])
def test_the_poses_alone_are_told_where_their_robot_is(roslaunch_says, words, said):
    parameters = yaml.safe_load(roslaunch_says("--dump-params", "naoqi_pose", "pose_manager.launch", *words))
    assert {parameters[f"/{node}/robot_namespace"] for node in ("pose_controller", "pose_manager")} == {said}


@pytest.mark.parametrize("file", ["pepper_full.launch", "pepper_full_py.launch", "tele_pepper.launch"])
def test_a_namespace_from_the_environment_stands_in_names_once(roslaunch_says, file):
    nodes = roslaunch_says("--nodes", "pepper_bringup", file, ROS_NAMESPACE="p1").split()
    assert "/p1/pepper_robot/pepper_laser" in nodes and all(node.count("p1") == 1 for node in nodes), nodes


@pytest.mark.parametrize("file", ["pepper_full.launch", "tele_pepper.launch", "tele_pepper_ros.launch"])
def test_calibration_files_reach_their_cameras(roslaunch_says, file):
    words = ("calibration_file_top:=/top.yaml", "calibration_file_bottom:=/bottom.yaml")
    parameters = yaml.safe_load(roslaunch_says("--dump-params", "pepper_bringup", file, *words))
    camera = "/pepper_robot/camera/"
    assert parameters[f"{camera}front/calibration_file_top"] == "/top.yaml"
    assert parameters[f"{camera}bottom/calibration_file_bottom"] == "/bottom.yaml"


@pytest.mark.parametrize("file", ["pepper_full.launch", "tele_pepper.launch", "tele_pepper_ros.launch"])
def test_goals_can_be_left_to_move_base(roslaunch_says, file):
    parameters = yaml.safe_load(roslaunch_says("--dump-params", "pepper_bringup", file, "goals:=false"))
    assert parameters["/naoqi_driver/goals"] is False


@pytest.mark.parametrize(("words", "space"), [((), "naoqi_driver"), (("namespace:=pepper_robot",), "pepper_robot")])
def test_the_line_of_the_driver_in_cpp_has_its_topics_where_that_driver_has_them(roslaunch_says, words, space):
    file = ("naoqi_driver", "naoqi_driver.launch")
    nodes = set(roslaunch_says("--nodes", *file, *words).split())
    sensors = ("camera/front", "camera/bottom", "camera/depth", "pepper_laser", "pepper_sonar", "naoqi_condition")
    assert {f"/{space}/{node}" for node in sensors} <= nodes
    assert f"imu/torso:={space}/imu/torso" in roslaunch_says("--args", "/naoqi_joint_states", *file, *words)
