"""ALVideoDevice's picture sizes and colour spaces, and conversion into them.

Ids: NAOqi 2.8 documentation, alvideodevice. Colour: BT.601; kYUV422 is what `cv2.COLOR_YUV2RGB_YUYV` decodes, kYUV what
`cv2.COLOR_YUV2RGB` decodes. Hue and saturation range from 0 to 255.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import cv2
import numpy as np

RESOLUTIONS: dict[int, tuple[int, int]] = {
    0: (160, 120),
    1: (320, 240),
    2: (640, 480),
    3: (1280, 960),
    4: (2560, 1920),
    5: (1280, 720),
    7: (80, 60),
    8: (40, 30),
    **{9 + halved: (640 >> halved, 360 >> halved) for halved in range(4)},
    **{13 + halved: (2560 >> halved, 720 >> halved) for halved in range(5)},
}
"""Resolution id -> width, height [px], for this robot's cameras. 5 and 9 to 12 are k720p and its halves, 13 to 17 two
such pictures side by side."""

DEPTH_RANGE = (0.4, 8.0)
"""Range of the Xtion [m]; everything outside is 0 (NAOqi 2.8 documentation, video_3D_pep_v18a)."""
STEREO_DEPTH_RANGE = (0.4, 3.68)
"""Range of the depth computed from two eyes [m]; documented (video_3D_pep) for the eight-bit picture."""

RGB_SPACES: dict[int, int] = {
    **dict.fromkeys(range(9), 1),
    **{9: 2, 10: 3, 11: 3, 12: 3, 13: 3, 14: 2, 15: 3, 18: 4},
}
"""Colour space id -> layers (bytes per pixel), colour cameras."""

DEPTH_SPACES: dict[int, int] = {0: 1, 11: 3, 13: 3, 17: 2, 19: 12, 20: 2, 21: 2, 23: 2}
"""Colour space id -> layers, depth camera."""
STEREO_DEPTH_SPACES = {space: DEPTH_SPACES[space] for space in (0, 11, 17, 19)}
"""Colour space id -> layers, depth computed from two eyes (video_3D_pep)."""


INFRARED_SATURATED = 1023
"""Brightest value of the infrared picture: ten bits. Everything nearer than the depth camera's range has it."""
_INFRARED_LIGHT = INFRARED_SATURATED * DEPTH_RANGE[0] ** 2


def convert_rgb(pixels: np.ndarray, space: int) -> np.ndarray:
    """Convert a colour picture into another colour space.

    Args:
        pixels: (height, width, 3) uint8, RGB.
        space: A key of RGB_SPACES.
    Returns:
        Contiguous uint8 of height · width · layers bytes, row by row.
    """
    return np.ascontiguousarray(_RGB[space](pixels))


def _yyuv(pixels: np.ndarray) -> np.ndarray:
    """Return Y Y' U V per two pixels, from Y U Y' V."""
    packed = cv2.cvtColor(pixels, cv2.COLOR_RGB2YUV_YUYV).reshape(-1, 4)
    return packed[:, [0, 2, 1, 3]]


def _hsy(pixels: np.ndarray) -> np.ndarray:
    hsv = cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV_FULL)
    hsv[:, :, 2] = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
    return hsv


def _hue_as_rgb(pixels: np.ndarray) -> np.ndarray:
    hsv = cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV_FULL)
    hsv[:, :, 1:] = 255
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB_FULL)


def _argb(pixels: np.ndarray) -> np.ndarray:
    out = np.empty((*pixels.shape[:2], 4), np.uint8)
    out[:, :, 0] = 255
    out[:, :, 1:] = pixels
    return out


def _yuv_plane(index: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda pixels: cv2.extractChannel(cv2.cvtColor(pixels, cv2.COLOR_RGB2YUV), index)


_RGB: dict[int, Callable[[np.ndarray], np.ndarray]] = {
    0: lambda pixels: cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY),
    1: _yuv_plane(1),
    2: _yuv_plane(2),
    3: lambda pixels: cv2.extractChannel(pixels, 0),
    4: lambda pixels: cv2.extractChannel(pixels, 1),
    5: lambda pixels: cv2.extractChannel(pixels, 2),
    6: lambda pixels: cv2.extractChannel(cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV_FULL), 0),
    7: lambda pixels: cv2.extractChannel(cv2.cvtColor(pixels, cv2.COLOR_RGB2HSV_FULL), 1),
    8: lambda pixels: cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY),
    9: lambda pixels: cv2.cvtColor(pixels, cv2.COLOR_RGB2YUV_YUYV),
    10: lambda pixels: cv2.cvtColor(pixels, cv2.COLOR_RGB2YUV),
    11: lambda pixels: pixels,
    12: _hsy,
    13: lambda pixels: cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR),
    14: _yyuv,
    15: _hue_as_rgb,
    18: _argb,
}


def convert_depth(
    depth: np.ndarray, space: int, fovy: float, depth_range: tuple[float, float] = DEPTH_RANGE
) -> np.ndarray:
    """Convert a depth picture into a space of the depth camera.

    Args:
        depth: (height, width) float32, distance from the image plane [m].
        space: A key of DEPTH_SPACES: 17 and 23 uint16 millimetres from the image plane, 20 uint16 infrared light that
            comes back from the camera's own lamp, 21 uint16 millimetres from the camera's centre, 19 three float32
            x ahead, y left, z up [m], 0 eight bits over the range, 11 and 13 false colour.
        fovy: Vertical field of view [rad].
        depth_range: Nearest and farthest [m].
    Returns:
        Contiguous array of height · width · layers bytes, row by row, little-endian; 0 where out of range.
    """
    near, far = depth_range
    seen = np.where((depth >= near) & (depth <= far), depth, np.float32(0.0))
    if space in (17, 23):
        return _millimetres(seen)
    height, width = depth.shape
    y, z = _rays(width, height, fovy)
    if space == 21:
        return _millimetres(seen * np.sqrt(1.0 + y * y + z * z))
    if space == 20:
        return _infrared(depth, y, z)
    if space == 19:
        return np.ascontiguousarray(np.stack([seen, seen * y, seen * z], axis=-1, dtype="<f4"))
    grey = (seen * (255.0 / far)).astype(np.uint8)
    if space == 0:
        return grey
    colours = cv2.applyColorMap(grey, cv2.COLORMAP_JET)
    colours[seen == 0.0] = 0
    return cv2.cvtColor(colours, cv2.COLOR_BGR2RGB) if space == 11 else colours


def _infrared(depth: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the light of a lamp at the camera that comes back: it falls with the square of the distance, and surfaces
    that are seen at an angle send less of it. All surfaces are equally bright to it."""
    away = depth * np.sqrt(1.0 + y * y + z * z)
    down, across = np.gradient(depth)
    step = depth * float(y[0, 0] - y[0, 1])  # width of a pixel at that depth [m]
    normal = np.sqrt((step - across * y - down * z) ** 2 + across * across + down * down)
    light = _INFRARED_LIGHT / (away * away) * np.clip(step / normal * depth / away, 0.05, 1.0)
    light[depth < DEPTH_RANGE[0]] = INFRARED_SATURATED
    return np.ascontiguousarray(np.minimum(light, INFRARED_SATURATED).astype("<u2"))


def _millimetres(metres: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray((metres * 1000.0 + 0.5).astype("<u2"))


@functools.lru_cache(maxsize=8)
def _rays(width: int, height: int, fovy: float) -> tuple[np.ndarray, np.ndarray]:
    """Return metres left and up per metre ahead for every pixel's centre: shapes (1, width), (height, 1)."""
    focal = 0.5 * height / np.tan(0.5 * fovy)
    left = (0.5 * (width - 1) - np.arange(width, dtype=np.float32)) / focal
    up = (0.5 * (height - 1) - np.arange(height, dtype=np.float32)) / focal
    return left[None, :].astype(np.float32), up[:, None].astype(np.float32)
