from __future__ import annotations

import numpy as np
import pytest
from pepper_sensors.colour import BGR, DEPTH, RGB, YUV422, UnknownColourSpace, convert

COLOURS = np.array(
    [[[255, 0, 0], [255, 0, 0], [0, 255, 0], [0, 255, 0]], [[0, 0, 255]] * 2 + [[128, 128, 128]] * 2], np.uint8
)


def yuyv(rgb: np.ndarray) -> bytes:
    """Y U Y' V, as the sensor delivers it, written out from ITU-R BT.601 with 16..235 luma."""
    r, g, b = (rgb[:, :, i].astype(float) for i in range(3))
    y = 16 + 0.257 * r + 0.504 * g + 0.098 * b
    u = 128 - 0.148 * r - 0.291 * g + 0.439 * b
    v = 128 + 0.439 * r - 0.368 * g - 0.071 * b
    out = np.empty((*rgb.shape[:2], 2))
    out[:, :, 0] = y
    out[:, 0::2, 1] = u[:, 0::2]
    out[:, 1::2, 1] = v[:, 0::2]
    return out.round().astype(np.uint8).tobytes()


def test_yuv422_becomes_rgb():
    pixels, encoding = convert(yuyv(COLOURS), 4, 2, 2, YUV422)
    assert encoding == "rgb8"
    assert np.abs(pixels.astype(int) - COLOURS).max() <= 3


def test_rgb_and_bgr_pass_unchanged():
    for space, encoding in ((RGB, "rgb8"), (BGR, "bgr8")):
        pixels, found = convert(COLOURS.tobytes(), 4, 2, 3, space)
        assert found == encoding
        assert (pixels == COLOURS).all()


def test_depth_is_little_endian_millimetres():
    pixels, encoding = convert(np.array([[400, 8000]], "<u2").tobytes(), 2, 1, 2, DEPTH)
    assert encoding == "16UC1"
    assert pixels.tolist() == [[400, 8000]]


def test_unknown_colour_space_is_refused_with_the_known_ones():
    with pytest.raises(UnknownColourSpace, match=r"12 has no conversion.*9, 11, 13"):
        convert(b"", 0, 0, 3, 12)


def test_wrong_sizes_are_refused():
    with pytest.raises(ValueError, match="24 bytes, the robot sent 23"):
        convert(bytes(23), 4, 2, 3, RGB)
    with pytest.raises(ValueError, match="3 bytes per pixel, the robot sent 4"):
        convert(bytes(32), 4, 2, 4, RGB)
