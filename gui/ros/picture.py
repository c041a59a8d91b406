"""A camera picture on its way from ROS to the screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from PyQt5.QtGui import QImage

from telepresence.video.displayable import as_grey
from telepresence.video.images import read_image_message

_FORMATS = {
    "rgb8": QImage.Format.Format_RGB888,
    "bgr8": QImage.Format.Format_BGR888,
    "rgba8": QImage.Format.Format_RGBA8888,
    "bgra8": QImage.Format.Format_ARGB32,  # four bytes, blue first, on a little-endian machine
    "mono8": QImage.Format.Format_Grayscale8,
}


@dataclass(frozen=True)
class Picture:
    """A camera picture.

    Args:
        pixels: As `telepresence.video.images.read_image_message` returns them.
        stamp: When the picture was taken [s since 1970].
        arrived: When it arrived here [monotonic s].
    """

    pixels: np.ndarray
    encoding: str
    stamp: float
    arrived: float


def read_picture(message: Any, arrived: float) -> Picture:
    """Convert a sensor_msgs/Image that arrived at `arrived` [monotonic s].

    Raises:
        ValueError: It cannot be read; the message says why.
    """
    return Picture(read_image_message(message), message.encoding, message.header.stamp.to_sec(), arrived)


def as_qimage(picture: Picture) -> QImage:
    """Return the picture as an image with pixels of its own, in the form that is painted fastest: of three bytes for a
    pixel each painting takes twice as long. Depth and other single-channel numbers become grey levels
    between their least and greatest finite value, near things bright.

    Raises:
        ValueError: The encoding cannot be shown.
    """
    pixels = picture.pixels
    if picture.encoding not in _FORMATS and pixels.ndim != 2:
        raise ValueError(f"pictures of encoding {picture.encoding!r} cannot be shown")
    if picture.encoding not in _FORMATS:
        pixels = as_grey(pixels)
    pixels = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    shape = _FORMATS.get(picture.encoding, QImage.Format.Format_Grayscale8)
    # PyQt5's stub knows no buffers other than bytes, which would be one more copy.
    image = QImage(pixels.data, width, height, pixels.strides[0], shape)  # type: ignore[call-overload]
    return image.convertToFormat(QImage.Format.Format_RGB32)  # a copy, whatever it was
