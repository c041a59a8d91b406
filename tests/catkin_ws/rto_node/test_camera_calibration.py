"""Both ways of the camera say how it was calibrated: the robot's own pictures, and those by WebRTC."""

from __future__ import annotations

import sys

import pytest
import yaml
from rto_node.camera_calibration import CALIBRATED_WIDTH, FOCAL_LENGTH

CALIBRATION = """
image_width: 640
image_height: 480
camera_name: c905
camera_matrix: {rows: 3, cols: 3, data: [530.0, 0, 311.0, 0, 529.0, 243.0, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.03, -0.11, 0.001, 0.002, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [528.0, 0, 310.0, 0, 0, 527.0, 242.0, 0, 0, 0, 1, 0]}
"""
DISTORTION = [0.03, -0.11, 0.001, 0.002, 0.0]


@pytest.fixture
def calibrated(tmp_path):
    """The parameter that names a file."""
    file = tmp_path / "c905.yaml"
    file.write_text(CALIBRATION)
    return f"_calibration_file:={file}"


def program(graph, package: str, name: str) -> str:
    return str(graph.workspace / "lib" / package / name)


@pytest.mark.ros
def test_the_robots_own_pictures(graph, calibrated):
    port = graph.free_port()
    robot = graph.run(sys.executable, "-m", "robotino_sim", "--port", str(port), "--scene", "empty")
    robot.wait_for("listening on")
    probe = graph.probe()
    probe.watch("/camera_info", "sensor_msgs/CameraInfo", ["D", "width", "K.0"])
    hostname = f"--hostname=127.0.0.1:{port}"
    with graph.run(program(graph, "rto_node", "rto_camera_node"), hostname, calibrated):
        distortion, width, focal_length = probe.newest("/camera_info")
    assert distortion == DISTORTION and focal_length == pytest.approx(530.0 * width / 640)


@pytest.mark.ros
def test_the_pictures_by_webrtc_without_anybody_who_takes_these(graph, calibrated):
    port = str(graph.free_port())
    sender = graph.run(
        program(graph, "rto_bringup", "robotino_onboard"), "camera", "--source", "test", "--address", "127.0.0.1",
        "--port", port,
    )  # fmt: skip
    probe = graph.probe()
    probe.watch("/img_raw/camera_info", "sensor_msgs/CameraInfo", ["D", "width", "K.0", "header.frame_id"])
    with sender, graph.run(program(graph, "rto_node", "rto_camera_receiver"), f"_sender:=127.0.0.1:{port}", calibrated):
        distortion, width, focal_length, frame = probe.newest("/img_raw/camera_info")
    assert distortion == DISTORTION and focal_length == pytest.approx(530.0 * width / 640)
    assert frame == "camera_optical_frame"


@pytest.mark.ros
def test_a_file_that_is_none_costs_no_pictures(graph, tmp_path):
    broken = tmp_path / "broken.yaml"
    broken.write_text("image_width: 640\n")
    port = graph.free_port()
    robot = graph.run(sys.executable, "-m", "robotino_sim", "--port", str(port), "--scene", "empty")
    robot.wait_for("listening on")
    probe = graph.probe()
    probe.watch("/uncalibrated/camera_info", "sensor_msgs/CameraInfo", ["D", "width", "K.0"])
    words = ("--hostname", f"127.0.0.1:{port}", f"_calibration_file:={broken}", "__ns:=/uncalibrated")
    node = graph.run(program(graph, "rto_node", "rto_camera_node"), *words)
    with node:
        distortion, width, focal_length = probe.newest("/uncalibrated/camera_info")
        assert distortion == [0.0] * 5 and focal_length == pytest.approx(FOCAL_LENGTH * width / CALIBRATED_WIDTH)
    assert node.output.count(f"{broken}: 'image_height' is missing") == 1, node.output


def test_the_launch_file_hands_it_on(roslaunch_says):
    words = ("rto_bringup", "rto.launch", "calibration_file:=/c905.yaml")
    parameters = yaml.safe_load(roslaunch_says("--dump-params", *words))
    for node in ("rto_camera", "rto_camera_receiver"):
        assert parameters[f"/rto3/{node}/calibration_file"] == "/c905.yaml"
