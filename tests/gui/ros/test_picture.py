"""Pictures of every encoding, as Qt shows them."""

import numpy as np
import pytest
from PyQt5.QtGui import QColor

from gui.ros.picture import Picture, as_qimage
from telepresence.video.images import ENCODINGS


def picture(pixels, encoding):
    return Picture(np.asarray(pixels), encoding, stamp=0.0, arrived=0.0)


def colour_at(image, x, y):
    colour = QColor(image.pixel(x, y))
    return colour.red(), colour.green(), colour.blue()


@pytest.mark.parametrize(
    ("encoding", "pixel"),
    [("rgb8", (10, 20, 30)), ("bgr8", (30, 20, 10)), ("rgba8", (10, 20, 30, 255)), ("bgra8", (30, 20, 10, 255))],
)
def test_colours(encoding, pixel):
    pixels = np.zeros((5, 7, len(pixel)), np.uint8)
    pixels[2, 3] = pixel
    image = as_qimage(picture(pixels, encoding))
    assert (image.width(), image.height()) == (7, 5)
    assert colour_at(image, 3, 2) == (10, 20, 30)


def test_the_image_outlives_its_message():
    pixels = np.full((4, 4, 3), 200, np.uint8)
    image = as_qimage(picture(pixels, "rgb8"))
    pixels[:] = 0
    assert colour_at(image, 0, 0) == (200, 200, 200)


def test_depth_is_bright_where_near_and_black_where_unknown():
    depth = np.array([[0, 500, 3000]], np.uint16)
    near, far = (
        colour_at(as_qimage(picture(depth, "16UC1")), 1, 0)[0],
        colour_at(as_qimage(picture(depth, "16UC1")), 2, 0)[0],
    )
    assert colour_at(as_qimage(picture(depth, "16UC1")), 0, 0) == (0, 0, 0)
    assert near > far > 0


@pytest.mark.parametrize("values", [[[np.nan, np.inf]], [[0.0, 0.0]], [[2.0, 2.0]]])
def test_strange_depth_is_no_accident(values):
    assert not as_qimage(picture(np.array(values, np.float32), "32FC1")).isNull()


@pytest.mark.parametrize("encoding", sorted(ENCODINGS))
def test_every_encoding_that_can_be_read_can_be_shown(encoding):
    kind, channels = ENCODINGS[encoding]
    shape = (3, 5, channels) if channels > 1 else (3, 5)
    assert as_qimage(picture(np.ones(shape, kind), encoding)).width() == 5


def test_an_unknown_encoding_is_named():
    with pytest.raises(ValueError, match="yuv422"):
        as_qimage(picture(np.zeros((2, 2, 2), np.uint8), "yuv422"))
