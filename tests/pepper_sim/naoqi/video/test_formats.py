"""Colour and depth conversion, without a robot."""

import cv2
import numpy as np
import pytest

from pepper_sim.naoqi.video.formats import DEPTH_SPACES, INFRARED_SATURATED, RGB_SPACES, convert_depth, convert_rgb

PIXELS = cv2.GaussianBlur(np.random.default_rng(1).integers(0, 255, (24, 32, 3), np.uint8), (5, 5), 0)


@pytest.mark.parametrize(("space", "layers"), RGB_SPACES.items())
def test_sizes_of_colour(space, layers):
    data = convert_rgb(PIXELS, space)
    assert data.flags.c_contiguous and data.nbytes == 24 * 32 * layers


@pytest.mark.parametrize(("space", "layers"), DEPTH_SPACES.items())
def test_sizes_of_depth(space, layers):
    data = convert_depth(np.full((24, 32), 2.0, np.float32), space, 0.8)
    assert data.flags.c_contiguous and data.nbytes == 24 * 32 * layers


def test_planes_and_orders():
    assert (convert_rgb(PIXELS, 3) == PIXELS[:, :, 0]).all() and (convert_rgb(PIXELS, 5) == PIXELS[:, :, 2]).all()
    assert (convert_rgb(PIXELS, 13) == PIXELS[:, :, ::-1]).all()
    argb = convert_rgb(PIXELS, 18)
    assert (argb[:, :, 0] == 255).all() and (argb[:, :, 1:] == PIXELS).all()
    packed, tiff = convert_rgb(PIXELS, 9).reshape(-1, 4), convert_rgb(PIXELS, 14).reshape(-1, 4)
    assert (tiff == packed[:, [0, 2, 1, 3]]).all()
    yuv = convert_rgb(PIXELS, 10)
    assert (convert_rgb(PIXELS, 1) == yuv[:, :, 1]).all()


def test_yuv_is_what_opencv_decodes():
    for space, code, channels in ((9, cv2.COLOR_YUV2RGB_YUYV, 2), (10, cv2.COLOR_YUV2RGB, 3)):
        decoded = cv2.cvtColor(convert_rgb(PIXELS, space).reshape(24, 32, channels), code)
        assert np.abs(decoded.astype(int) - PIXELS).mean() < 6.0


def test_depth_out_of_range_is_zero():
    depth = np.array([[0.1, 0.4, 8.0, 8.1, 30.0]], np.float32)
    assert convert_depth(depth, 17, 0.8).tolist() == [[0, 400, 8000, 0, 0]]
    assert convert_depth(depth, 0, 0.8)[0, 0] == 0 and convert_depth(depth, 0, 0.8)[0, 2] == 255


def test_infrared_light_falls_with_the_square_of_the_distance_and_off_a_tilted_wall():
    walls = [int(convert_depth(np.full((9, 9), m, np.float32), 20, 0.8)[4, 4]) for m in (0.3, 1.0, 2.0)]
    assert walls[0] == INFRARED_SATURATED and walls[1] == pytest.approx(4 * walls[2], abs=4)
    tangents = np.tan(0.4) * np.linspace(-8 / 9, 8 / 9, 9, dtype=np.float32)
    tilted = np.tile(1.0 / (1.0 + np.tan(np.pi / 3) * tangents), (9, 1)).astype(np.float32)
    assert convert_depth(tilted, 20, 0.8)[4, 4] == pytest.approx(walls[1] * np.cos(np.pi / 3), rel=0.05)
    assert (convert_depth(0.3 * tilted, 20, 0.8)[:, 4] == INFRARED_SATURATED).all(), "too close, at any angle"


def test_points_lie_on_their_rays():
    depth = np.full((3, 5), 2.0, np.float32)
    points = convert_depth(depth, 19, np.pi / 2)
    assert points[1, 2] == pytest.approx([2.0, 0.0, 0.0])
    assert points[0, 0, 1] > 0 > points[2, 4, 1], "left is positive"
    assert points[0, 0, 2] > 0 > points[2, 4, 2], "up is positive"
    distance = convert_depth(depth, 21, np.pi / 2)
    assert distance[0, 0] == pytest.approx(1000 * np.linalg.norm(points[0, 0]), abs=1)
