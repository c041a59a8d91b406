"""Pictures made into JPEG files; what comes from outside is in test_jpeg_header.py."""

import numpy as np
import pytest

from telepresence.video.jpeg import decode_jpeg, encode_jpeg

ORANGE = (230, 130, 20)


@pytest.mark.parametrize(("order", "colour"), [("rgb", ORANGE), ("bgr", ORANGE[::-1])])
def test_colours_stay_what_they_are(order, colour):
    pixels = decode_jpeg(encode_jpeg(np.full((16, 24, 3), colour, np.uint8), order=order))
    assert pixels.shape == (16, 24, 3)
    assert np.abs(pixels[8, 12].astype(int) - ORANGE[::-1]).max() < 4


def test_grey_pictures_stay_grey():
    assert np.abs(decode_jpeg(encode_jpeg(np.full((16, 24), 100, np.uint8)), grey=True).astype(int) - 100).max() < 3


@pytest.mark.parametrize(
    "pixels",
    [
        np.zeros((0, 0, 3), np.uint8),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((4, 4, 7), np.uint8),
        np.zeros((4, 4, 3), np.float64),
        np.zeros((4, 4), np.uint16),
        np.zeros((70_000, 1), np.uint8),
    ],
    ids=lambda pixels: f"{pixels.shape} {pixels.dtype}",
)
@pytest.mark.parametrize("order", ["rgb", "bgr"])
def test_what_is_no_picture_is_refused_by_its_shape(pixels, order):
    with pytest.raises(ValueError, match=rf"^OpenCV cannot encode \({pixels.shape[0]}, .* {pixels.dtype} as JPEG"):
        encode_jpeg(pixels, order=order)
