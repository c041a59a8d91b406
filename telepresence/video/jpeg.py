"""Pictures as JPEG files: made here, and decoded after a look at their headers (`telepresence.video.jpeg_header`)."""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np

from telepresence.video.jpeg_header import MAX_PIXELS, check_jpeg

QUALITY = 80
"""OpenCV's scale, 0 to 100: about 60 kB for 640x480."""
_END = b"\xff\xd9"


def encode_jpeg(pixels: np.ndarray, quality: int = QUALITY, order: Literal["rgb", "bgr"] = "rgb") -> bytes:
    """Return a complete JPEG file.

    Args:
        pixels: (height, width, 3) uint8, or (height, width) uint8, grey.
        quality: OpenCV's scale, 0 to 100.
        order: Of the three colours.
    Raises:
        ValueError: They are no such pixels, or OpenCV could not encode them.
    """
    cannot = f"OpenCV cannot encode {pixels.shape} {pixels.dtype} as JPEG"
    if pixels.dtype != np.uint8:  # OpenCV would cut other numbers off at 255
        raise ValueError(cannot)
    try:
        if pixels.ndim == 3 and order == "rgb":
            pixels = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
        done, data = cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, quality))
    except cv2.error as error:
        raise ValueError(f"{cannot}: {error.err}") from error
    if not done:
        raise ValueError(cannot)
    return data.tobytes()


def decode_jpeg(data: bytes, grey: bool = False, max_pixels: int = MAX_PIXELS) -> np.ndarray:
    """Decode a JPEG file that comes from outside.

    Args:
        data: The file.
        grey: Decode the brightness only.
        max_pixels: How many it may have.
    Returns:
        (height, width, 3) uint8, BGR, or (height, width) uint8.
    Raises:
        ValueError: See `check_jpeg`, or it cannot be decoded.
    """
    header = check_jpeg(data, max_pixels)
    if data.rfind(_END) < 0:  # from the end, where it should be
        raise ValueError("a JPEG that breaks off")
    flags = (cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR) | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        pixels: np.ndarray | None = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise ValueError(f"a JPEG that cannot be decoded: {error.err}") from error
    if pixels is None or pixels.shape[:2] != (header.height, header.width):
        raise ValueError(f"a damaged JPEG of {len(data)} bytes")
    return pixels
