"""Turns camera pictures of any encoding into what a screen or a JPEG can show. Neither ROS nor Qt."""

from __future__ import annotations

import cv2
import numpy as np

_TO_BGR = {"rgb8": cv2.COLOR_RGB2BGR, "rgba8": cv2.COLOR_RGBA2BGR, "bgra8": cv2.COLOR_BGRA2BGR}
_AS_IT_IS = ("bgr8", "mono8")


def as_bgr(pixels: np.ndarray, encoding: str) -> np.ndarray:
    """Return the picture as (height, width, 3) uint8, BGR, or (height, width) uint8, grey.

    Args:
        pixels: As `telepresence.video.images.read_image_message` returns them.
        encoding: Of sensor_msgs/Image. Depth and other single-channel numbers become grey levels, see `as_grey`.

    Raises:
        ValueError: The encoding has several channels and is none of the known ones.
    """
    if encoding in _TO_BGR:
        return cv2.cvtColor(pixels, _TO_BGR[encoding])
    if encoding in _AS_IT_IS:
        return pixels
    if pixels.ndim != 2:
        raise ValueError(f"pictures of encoding {encoding!r} cannot be shown")
    return as_grey(pixels)


def as_grey(values: np.ndarray) -> np.ndarray:
    """Return grey levels (height, width) uint8 between the least and the greatest finite value, near things bright.

    Zero and what is not finite become black: depth cameras write them where they saw nothing.
    """
    values = values.astype(np.float32)
    seen = np.isfinite(values) & (values > 0.0)
    if not seen.any():
        return np.zeros(values.shape, np.uint8)
    least, greatest = values[seen].min(), values[seen].max()
    grey = 255.0 - 215.0 * (values - least) / max(float(greatest - least), 1e-6)
    return np.where(seen, grey, 0.0).astype(np.uint8)
