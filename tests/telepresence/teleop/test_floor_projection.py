"""Pixels and the floor. Expected numbers come from the geometry, not from the code."""

import math

import numpy as np
import pytest

from telepresence.teleop.floor_projection import floor_place, pixel_of, scaled_to
from telepresence.teleop.robot_readings import CameraView, Lens

LENS = Lens(fx=525.0, fy=525.0, cx=320.0, cy=240.0, width=640, height=480)


def camera(height=1.12, pitch=0.0, yaw=0.0, x=0.0, y=0.0):
    """A camera `height` over the floor, looking `pitch` down [rad] and turned left by `yaw`."""
    c, s = math.cos(pitch), math.sin(pitch)
    right, down, ahead = (0.0, -1.0, 0.0), (-s, 0.0, -c), (c, 0.0, -s)
    turn = np.array(((math.cos(yaw), -math.sin(yaw), 0), (math.sin(yaw), math.cos(yaw), 0), (0, 0, 1)))
    return CameraView(LENS, turn @ np.array((right, down, ahead)).T, np.array((x, y, height)))


def test_depth_of_a_level_camera_is_height_times_focal_length_by_rows_below_the_middle():
    place = floor_place(camera(height=1.12), 320.0, 240.0 + 105.0, farthest=10.0)
    assert place == pytest.approx((1.12 * 525.0 / 105.0, 0.0))


def test_a_pixel_left_of_the_middle_is_left_of_the_robot():
    place = floor_place(camera(), 220.0, 400.0, farthest=10.0)
    assert place.y == pytest.approx(place.x * 100.0 / 525.0)


def test_a_pitched_camera_sees_the_floor_in_the_middle_of_the_picture():
    place = floor_place(camera(height=0.5, pitch=math.radians(45)), 320.0, 240.0, farthest=10.0)
    assert (place.x, place.y) == pytest.approx((0.5, 0.0))


def test_the_cameras_own_place_and_turn_count():
    place = floor_place(camera(height=0.5, pitch=math.radians(45), yaw=math.pi / 2, x=1.0, y=2.0), 320.0, 240.0, 10.0)
    assert (place.x, place.y) == pytest.approx((1.0, 2.5))


@pytest.mark.parametrize("row", [0.0, 239.0, 240.0, 255.0])
def test_there_is_no_floor_above_the_horizon_nor_right_below_it(row):
    assert floor_place(camera(), 320.0, row, farthest=100.0) is None


def test_places_far_away_are_moved_nearer_in_the_same_direction():
    far = floor_place(camera(), 420.0, 280.0, farthest=100.0)
    near = floor_place(camera(), 420.0, 280.0, farthest=3.0)
    assert math.hypot(near.x, near.y) == pytest.approx(3.0) and math.hypot(far.x, far.y) > 3.0
    assert math.atan2(near.y, near.x) == pytest.approx(math.atan2(far.y, far.x))


@pytest.mark.parametrize("pitch", [0.0, 0.15, 0.7])
@pytest.mark.parametrize("yaw", [0.0, -0.8])
def test_there_and_back_is_the_same_pixel(pitch, yaw):
    view = camera(pitch=pitch, yaw=yaw, x=0.3, y=-2.0)
    for u in (10.0, 320.0, 630.0):
        for v in (350.0, 470.0):
            place = floor_place(view, u, v, farthest=100.0)
            assert pixel_of(view, place.x, place.y) == pytest.approx((u, v), abs=0.01)


def test_what_is_behind_the_lens_has_no_pixel():
    assert pixel_of(camera(), -1.0, 0.0) is None


def test_a_smaller_picture_shows_the_same_places():
    view = camera()
    small = scaled_to(view, 320, 240)
    assert floor_place(small, 160.0, 200.0, 10.0) == pytest.approx(floor_place(view, 320.0, 400.0, 10.0))
