"""Pixels of ALVideoDevice to the encodings of sensor_msgs/Image.

Colour-space ids and layouts: NAOqi 2.8 documentation, ALVideoDevice, "colour spaces".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

LARGEST_SIDE = 4096
"""Pixels; the largest of NAOqi's resolutions has 2560. All their widths are even."""
YUV422, RGB, BGR, DEPTH = 9, 11, 13, 17


class UnknownColourSpace(ValueError):
    """There is no conversion for this colour space."""


class _Conversion(NamedTuple):
    layers: int
    encoding: str
    convert: Callable[[np.ndarray], np.ndarray]


def _plane(raw: np.ndarray) -> np.ndarray:
    return raw[:, :, 0]


def _millimetres(raw: np.ndarray) -> np.ndarray:
    return raw.view("<u2")[:, :, 0]


def _unchanged(raw: np.ndarray) -> np.ndarray:
    return raw


_CONVERSIONS: dict[int, _Conversion] = {
    0: _Conversion(1, "mono8", _plane),
    # Two bytes a pixel instead of three: a third less on the Wi-Fi, and the sensor's own format. Y U Y' V.
    YUV422: _Conversion(2, "rgb8", lambda raw: cv2.cvtColor(raw, cv2.COLOR_YUV2RGB_YUY2)),
    RGB: _Conversion(3, "rgb8", _unchanged),
    BGR: _Conversion(3, "bgr8", _unchanged),
    DEPTH: _Conversion(2, "16UC1", _millimetres),
    20: _Conversion(2, "16UC1", _millimetres),
    21: _Conversion(2, "16UC1", _millimetres),
    23: _Conversion(2, "16UC1", _millimetres),
}


def convert(pixels: bytes | bytearray, width: int, height: int, layers: int, space: int) -> tuple[np.ndarray, str]:
    """Pixels of one picture and their encoding ("rgb8", "bgr8", "mono8" or "16UC1" [mm]).

    Args:
        pixels: `width * height * layers` bytes, row by row, top left first.
        space: NAOqi's id of the colour space.
    Returns:
        Array (height, width[, 3]), uint8 or uint16.
    Raises:
        UnknownColourSpace: There is no conversion; the text lists the ids that have one.
        ValueError: The number of bytes does not fit.
    """
    require_known(space)
    conversion = _CONVERSIONS[space]
    if layers != conversion.layers:
        raise ValueError(f"colour space {space} has {conversion.layers} bytes per pixel, the robot sent {layers}")
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE) or width % 2:
        raise ValueError(f"{width}x{height} is no size of a picture")
    expected = width * height * layers
    if len(pixels) != expected:
        raise ValueError(f"{width}x{height}x{layers} needs {expected} bytes, the robot sent {len(pixels)}")
    raw = np.frombuffer(pixels, np.uint8).reshape(height, width, layers)
    return conversion.convert(raw), conversion.encoding


def require_known(space: int) -> None:
    """Raises UnknownColourSpace when pictures in this colour space cannot be converted."""
    if space not in _CONVERSIONS:
        known = ", ".join(map(str, _CONVERSIONS))
        raise UnknownColourSpace(f"colour space {space} has no conversion; these have: {known}")
