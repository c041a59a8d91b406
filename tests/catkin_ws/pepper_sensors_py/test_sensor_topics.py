"""Cameras, sonars and lasers on ROS topics, with the simulated robot; its head is the one with the stereo camera."""

from __future__ import annotations

import math
import re

import pytest
import qi

pytestmark = pytest.mark.ros


@pytest.fixture(scope="module")
def robot(graph):
    return graph.start_robot("apartment", "--head", "1.8")


@pytest.fixture(scope="module")
def video(graph, robot):
    """ALVideoDevice, to see who is subscribed."""
    session = qi.Session()
    session.connect(f"tcp://127.0.0.1:{graph.robot_port}")
    yield session.service("ALVideoDevice")
    session.close()


@pytest.fixture(scope="module")
def front(graph, robot):
    return graph.run_node(
        "pepper_sensors_py", "camera.py", "__name:=front", "_color_space:=9", "_resolution:=2", "_frame_rate:=15"
    )


@pytest.fixture(scope="module")
def probe(graph, front):
    for name, *settings in (
        ("depth", "_source:=2", "_color_space:=17", "_resolution:=9", "_frame_rate:=10"),
        ("stereo", "_source:=3", "_color_space:=9", "_resolution:=15", "_frame_rate:=10"),
    ):
        graph.run_node("pepper_sensors_py", "camera.py", f"__name:={name}", *settings)
    graph.run_node("pepper_sensors_py", "sonar.py")
    graph.run_node("pepper_sensors_py", "laser.py")
    return graph.probe()


def test_camera_is_idle_while_nobody_looks(probe, video, front):
    front.wait_for("connected")
    assert video.getSubscribers() == []
    probe.watch(
        "/front/image_raw",
        "sensor_msgs/Image",
        ["width", "height", "encoding", "header.frame_id", "len(data)", "header.stamp"],
    )
    assert probe.latest("/front/image_raw")[:5] == [640, 480, "rgb8", "CameraTop_optical_frame", 640 * 480 * 3]
    assert len(video.getSubscribers()) == 1


def test_stamps_are_the_moment_of_the_picture(probe, wait_until):
    probe.forget("/front/image_raw")
    wait_until(lambda: len(probe.seen("/front/image_raw")) >= 10, "ten pictures")
    stamps = [fields[5] for _, fields in probe.seen("/front/image_raw")]
    assert stamps == sorted(set(stamps)), "every picture once, in order"
    assert all(0 < at - fields[5] < 1.0 for at, fields in probe.seen("/front/image_raw"))


def test_camera_info_fits_the_pictures(probe):
    probe.watch("/front/camera_info", "sensor_msgs/CameraInfo", ["width", "height", "K", "header.frame_id"])
    width, height, k, frame = probe.latest("/front/camera_info")
    assert (width, height, frame) == (640, 480, "CameraTop_optical_frame")
    # 57.2 degrees or 56.3 degrees of view, by body version: fx 587 or 598 px (NAOqi 2.8 documentation, video_2D_pep).
    assert 560 < k[0] < 610
    assert k[2] == pytest.approx(320, abs=2)


def test_camera_info_of_a_calibration_file(graph, probe):
    file = "package://pepper_sensors_py/config/camera_top_640x480.yaml"
    graph.run_node("pepper_sensors_py", "camera.py", "__name:=calibrated", f"_calibration_file_top:={file}")
    probe.watch("/calibrated/camera_info", "sensor_msgs/CameraInfo", ["width", "K"])
    width, k = probe.latest("/calibrated/camera_info")
    assert width == 320 and k[0] == pytest.approx(556.845 / 2)


def test_a_calibration_file_that_is_not_there_costs_no_pictures(graph, probe):
    file = "package://pepper_sensors_py/config/none.yaml"
    node = graph.run_node("pepper_sensors_py", "camera.py", "__name:=uncalibrated", f"_calibration_file_top:={file}")
    probe.watch("/uncalibrated/camera_info", "sensor_msgs/CameraInfo", ["width", "K"])
    width, k = probe.latest("/uncalibrated/camera_info")
    assert width == 320 and 280 < k[0] < 305, "by the view angles"
    assert len(re.findall("uncalibrated/calibration_file_top.*config/none.yaml", node.output)) == 1, node.output


def test_jpeg_pictures(probe):
    probe.watch("/front/image_raw/compressed", "sensor_msgs/CompressedImage", ["format", "data"])
    form, data = probe.latest("/front/image_raw/compressed")
    assert form == "jpeg"
    assert data[:2] == [0xFF, 0xD8]


def test_depth_in_millimetres(probe):
    probe.watch("/depth/image_raw", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id", "step"])
    assert probe.latest("/depth/image_raw") == [640, 360, "16UC1", "CameraDepth_optical_frame", 1280]


def test_both_eyes_side_by_side_with_the_camera_info_of_one(probe):
    probe.watch("/stereo/image_raw", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
    probe.watch("/stereo/camera_info", "sensor_msgs/CameraInfo", ["width", "height", "K"])
    assert probe.latest("/stereo/image_raw") == [640, 180, "rgb8", "CameraDepth_optical_frame"]
    width, height, k = probe.latest("/stereo/camera_info")
    # 60 degrees from top to bottom (NAOqi 2.8 documentation, video_Stereo_pep).
    assert (width, height) == (320, 180) and k[0] == pytest.approx(90 / math.tan(math.radians(30)), rel=1e-3)
    assert k[2] == pytest.approx(160)


def test_sonars(probe):
    for side, frame in (("front", "SonarFront_frame"), ("back", "SonarBack_frame")):
        topic = f"/sonar/{side}"
        probe.watch(
            topic, "sensor_msgs/Range", ["range", "min_range", "max_range", "header.frame_id", "radiation_type"]
        )
        distance, least, most, found, kind = probe.latest(topic)
        assert (found, kind) == (frame, 0)
        assert (least, most) == (pytest.approx(0.25), pytest.approx(2.55))
        assert distance == math.inf or least <= distance <= most


def test_lasers(probe):
    probe.watch(
        "/laser", "sensor_msgs/LaserScan", ["header.frame_id", "angle_min", "angle_max", "angle_increment", "ranges"]
    )
    frame, first, last, increment, ranges = probe.latest("/laser")
    assert frame == "base_footprint"
    assert len(ranges) == round((last - first) / increment) + 1
    assert sum(not math.isnan(distance) for distance in ranges) >= 40
    probe.watch("/laser/srd_left/scan", "sensor_msgs/LaserScan", ["header.frame_id", "angle_min", "len(ranges)"])
    assert probe.latest("/laser/srd_left/scan") == [
        "SurroundingLeftLaser_frame",
        pytest.approx(math.radians(-28), abs=0.01),
        15,
    ]
    probe.watch("/laser/shovel/pointcloud", "sensor_msgs/PointCloud2", ["header.frame_id", "point_step", "width"])
    assert probe.latest("/laser/shovel/pointcloud")[:2] == ["SurroundingFrontLaser_frame", 12]


def test_restarted_camera_node_removes_what_it_left(graph, probe, front, video):
    probe.latest("/front/image_raw")
    front.kill()
    assert any("front" in name for name in video.getSubscribers())
    graph.run_node("pepper_sensors_py", "camera.py", "__name:=front", "_color_space:=9", "_resolution:=2")
    probe.latest("/front/image_raw")
    assert sum("front" in name for name in video.getSubscribers()) == 1


def test_pictures_come_back_with_the_robot(graph, robot, probe):
    probe.latest("/front/image_raw")
    robot.kill()
    graph.start_robot("apartment")
    probe.latest("/front/image_raw")
    probe.latest("/laser")
    probe.latest("/sonar/front")


def test_unknown_colour_space_ends_the_node_with_an_error(graph):
    node = graph.run_node("pepper_sensors_py", "camera.py", "__name:=odd", "_color_space:=99")
    assert node.process.wait(30) == 1
    assert "colour space 99 has no conversion" in node.output
