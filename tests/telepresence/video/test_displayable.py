"""Pictures of any encoding can be shown."""

import numpy as np
import pytest

from telepresence.video.displayable import as_bgr, as_grey

ORANGE_BGR = (20, 120, 240)


@pytest.mark.parametrize(
    ("encoding", "pixel"),
    [
        ("bgr8", (20, 120, 240)),
        ("rgb8", (240, 120, 20)),
        ("rgba8", (240, 120, 20, 255)),
        ("bgra8", (20, 120, 240, 255)),
    ],
)
def test_colours_become_bgr(encoding, pixel):
    pixels = np.full((4, 6, len(pixel)), pixel, np.uint8)
    shown = as_bgr(pixels, encoding)
    assert shown.shape == (4, 6, 3) and tuple(shown[2, 3]) == ORANGE_BGR


def test_grey_pictures_stay_as_they_are():
    pixels = np.arange(24, dtype=np.uint8).reshape(4, 6)
    assert np.array_equal(as_bgr(pixels, "mono8"), pixels)


def test_near_things_in_a_depth_picture_are_brighter_than_far_ones_and_nothing_is_black():
    depth = np.array([[0.5, 4.0], [0.0, np.nan]], np.float32)
    shown = as_bgr(depth, "32FC1")
    assert shown.dtype == np.uint8
    assert shown[0, 0] == 255 and 0 < shown[0, 1] < 255
    assert shown[1, 0] == 0 and shown[1, 1] == 0


def test_a_depth_picture_without_any_distance_is_black():
    assert not as_grey(np.full((2, 2), np.inf, np.float32)).any()


def test_an_encoding_that_nobody_can_show_is_named():
    with pytest.raises(ValueError, match="yuv422"):
        as_bgr(np.zeros((2, 2, 2), np.uint8), "yuv422")
