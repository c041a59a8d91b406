"""Pictures as JPEG files."""

from __future__ import annotations

import cv2
import numpy as np

QUALITY = 80
"""OpenCV's scale, 0 to 100: about 60 kB for 640x480."""


def encode_jpeg(pixels: np.ndarray, quality: int = QUALITY) -> bytes:
    """Return a complete JPEG file.

    Args:
        pixels: (height, width, 3) uint8, RGB.
    Raises:
        RuntimeError: OpenCV could not encode it.
    """
    bgr = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    done, data = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, quality))
    if not done:
        raise RuntimeError("OpenCV could not encode a picture as JPEG")
    return data.tobytes()
