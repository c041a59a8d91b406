from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from telepresence_ros.camera_model import find_calibration, pinhole, read_calibration

SOURCES = Path(__file__).resolve().parents[3] / "catkin_ws" / "src"
CONFIG = SOURCES / "pepper_sensors_py" / "config"


def test_pinhole_of_a_symmetric_camera():
    # 57.2 x 44.3 degrees at 640 x 480: fx = 587 px (NAOqi 2.8 documentation, video_2D_pep; tan by hand).
    h, v = math.radians(57.2) / 2, math.radians(44.3) / 2
    model = pinhole(640, 480, (h, v, -h, -v))
    assert model.K == pytest.approx((586.9, 0, 320, 0, 589.5, 240, 0, 0, 1), abs=0.2)
    assert model.P[:7] == pytest.approx((586.9, 0, 320, 0, 0, 589.5, 240), abs=0.2)


def test_pinhole_edges_project_to_the_edges_of_an_asymmetric_camera():
    left, top, right, bottom = 0.5, 0.3, -0.4, -0.35
    model = pinhole(320, 240, (left, top, right, bottom))
    fx, cx, fy, cy = model.K[0], model.K[2], model.K[4], model.K[5]
    assert cx - fx * math.tan(left) == pytest.approx(0)
    assert cx - fx * math.tan(right) == pytest.approx(320)
    assert cy - fy * math.tan(top) == pytest.approx(0)
    assert cy - fy * math.tan(bottom) == pytest.approx(240)


@pytest.mark.parametrize("angles", [(0, 0, 0, 0), (-0.5, 0.4, 0.5, -0.4), (math.nan,) * 4, (2.0, 0.4, -0.5, -0.4)])
def test_angles_without_a_field_of_view_are_refused(angles):
    with pytest.raises(ValueError, match="field of view"):
        pinhole(640, 480, angles)


CALIBRATION = """
image_width: 640
image_height: 480
camera_name: CameraTop
camera_matrix: {rows: 3, cols: 3, data: [556.845, 0, 309.367, 0, 555.899, 230.592, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.05452, 0.06920, -0.00241, -0.00112, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [551.59, 0, 308.271, 0, 0, 550.291, 229.201, 0, 0, 0, 1, 0]}
"""


def test_calibration_file_is_read_and_scaled(tmp_path):
    path = tmp_path / "top.yaml"
    path.write_text(CALIBRATION)
    model = read_calibration(path)
    assert model.K[0] == 556.845
    half = model.scaled(320, 240)
    assert (half.width, half.height) == (320, 240)
    assert half.K == pytest.approx((278.4225, 0, 154.6835, 0, 277.9495, 115.296, 0, 0, 1))
    assert half.P[2] == pytest.approx(154.1355)
    assert half.D == model.D


def test_broken_calibration_says_what_is_missing(tmp_path):
    path = tmp_path / "top.yaml"
    path.write_text("image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n")
    with pytest.raises(ValueError, match="distortion_coefficients"):
        read_calibration(path)
    path.write_text("[]")
    with pytest.raises(ValueError, match="not a calibration"):
        read_calibration(path)


WIDTH, MATRIX = "image_width: 640", "{rows: 3, cols: 3, data: [556.845, 0, 309.367, 0, 555.899, 230.592, 0, 0, 1]}"


@pytest.mark.parametrize(
    ("part", "other", "complaint"),
    [
        (WIDTH, "image_width: [640", "while parsing"),
        (WIDTH, "image_width: null", "image_width is None"),
        (WIDTH, "image_width: 0", "image_width is 0"),
        ("image_height: 480", "image_height: .inf", "image_height is inf"),
        (MATRIX, "null", "camera_matrix is no matrix"),
        (MATRIX, "[1, 0, 0, 0, 1, 0, 0, 0, 1]", "camera_matrix is no matrix"),
        (MATRIX, "{rows: 3, cols: 3}", "camera_matrix is no matrix"),
        ("309.367", "[309.367]", "camera_matrix is no matrix"),
        ("309.367", ".nan", "camera_matrix has numbers that are not finite"),
        ("309.367, ", "", "camera_matrix has 8 numbers instead of 9"),
        ("-0.05452", ".inf", "distortion_coefficients has numbers that are not finite"),
    ],
)
def test_what_is_no_calibration_is_refused_in_a_sentence(tmp_path, part, other, complaint):
    path = tmp_path / "top.yaml"
    path.write_text(CALIBRATION.replace(part, other))
    with pytest.raises(ValueError, match=f"^{re.escape(f'{path}: {complaint}')}.*$"):
        read_calibration(path)


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("/data/top camera.yaml", Path("/data/top camera.yaml")),
        ("file:///data/top%20camera.yaml", Path("/data/top camera.yaml")),
        ("package://pepper_sensors_py/config/camera_top_640x480.yaml", CONFIG / "camera_top_640x480.yaml"),
    ],
)
def test_a_calibration_is_found_by_path_or_address(monkeypatch, name, path):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(SOURCES))
    assert find_calibration(name) == path


@pytest.mark.parametrize(
    "name", ["http://lab/top.yaml", "file://data/top.yaml", "package:///top.yaml", "package://none_of_ours/top.yaml"]
)
def test_an_address_that_names_no_file_is_refused(name):
    with pytest.raises(ValueError, match=re.escape(name)):
        find_calibration(name)


@pytest.mark.parametrize("name", ["camera_top_640x480", "camera_bottom_640x480"])
def test_shipped_calibrations_can_be_read(name):
    model = read_calibration(CONFIG / f"{name}.yaml")
    assert (model.width, model.height) == (640, 480)
    assert 540 < model.K[0] < 570
