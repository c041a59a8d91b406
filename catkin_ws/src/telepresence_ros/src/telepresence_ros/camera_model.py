"""What sensor_msgs/CameraInfo says about a camera: from its view angles, or from a calibration file.

The file is what camera_calibration writes (YAML: image_width, image_height, camera_matrix, distortion_model,
distortion_coefficients, rectification_matrix, projection_matrix).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import rospkg
import yaml

NARROWEST = 1e-3
"""Smallest view angle, and how far a view stays from looking aside [rad]."""
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class CameraModel:
    """The fields of sensor_msgs/CameraInfo: size [px], distortion, and the matrices K (3x3), R (3x3), P (3x4), row by
    row."""

    width: int
    height: int
    distortion_model: str
    D: tuple[float, ...]
    K: tuple[float, ...]
    R: tuple[float, ...]
    P: tuple[float, ...]

    def scaled(self, width: int, height: int) -> CameraModel:
        """The same camera at another resolution."""
        if (width, height) == (self.width, self.height):
            return self
        sx, sy = width / self.width, height / self.height
        k = tuple(value * scale for value, scale in zip(self.K, (sx,) * 3 + (sy,) * 3 + (1.0,) * 3, strict=True))
        p = tuple(value * scale for value, scale in zip(self.P, (sx,) * 4 + (sy,) * 4 + (1.0,) * 4, strict=True))
        return CameraModel(width, height, self.distortion_model, self.D, k, self.R, p)


def pinhole(width: int, height: int, angles: Sequence[float]) -> CameraModel:
    """An ideal camera whose edges are seen at these angles: left, top (positive), right, bottom (negative) [rad].

    Every reply of the robot carries them, so this fits the camera that took the picture.

    Raises:
        ValueError: The angles span no field of view.
    """
    left, top, right, bottom = angles
    edge = math.pi / 2 - NARROWEST
    if not (-edge < right < left - NARROWEST < edge and -edge < bottom < top - NARROWEST < edge):
        raise ValueError(f"view angles left {left}, top {top}, right {right}, bottom {bottom} span no field of view")
    fx = width / (math.tan(left) - math.tan(right))
    fy = height / (math.tan(top) - math.tan(bottom))
    cx, cy = fx * math.tan(left), fy * math.tan(top)
    k = (fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    p = (fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0)
    return CameraModel(width, height, "plumb_bob", (0.0,) * 5, k, IDENTITY, p)


def centred(width: int, height: int, focal_length: float) -> CameraModel:
    """Return an ideal camera that looks through the middle of its picture; the focal length in [px]."""
    f, cx, cy = focal_length, width / 2, height / 2
    k = (f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0)
    p = (f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0)
    return CameraModel(width, height, "plumb_bob", (0.0,) * 5, k, IDENTITY, p)


def find_calibration(name: str) -> Path:
    """Return the file that is named by a path, or, as in camera_info_manager, by file:///PATH or package://PACKAGE/PATH.

    Raises:
        ValueError: There is no such package, or it is another kind of address.
    """
    scheme, is_address, rest = name.partition("://")
    if not is_address:
        return Path(name)
    if scheme == "file" and rest.startswith("/"):
        return Path(unquote(rest))
    package, _, inside = unquote(rest).partition("/")
    if scheme != "package" or not package:
        raise ValueError(f"{name}: a calibration file is a path, file:///PATH or package://PACKAGE/PATH")
    try:
        return Path(rospkg.RosPack().get_path(package), inside)
    except rospkg.ResourceNotFound:
        raise ValueError(f"{name}: there is no package {package}") from None


def read_calibration(path: Path) -> CameraModel:
    """The camera of a calibration file.

    Raises:
        OSError: It cannot be read.
        ValueError: It is not a calibration; the text names the file and says what is wrong with it.
    """
    try:
        content = yaml.safe_load(path.read_text())
        if not isinstance(content, dict):
            raise ValueError("this is not a calibration file")
        return CameraModel(
            width=_size(content, "image_width"),
            height=_size(content, "image_height"),
            distortion_model=str(content["distortion_model"]),
            D=_numbers(content, "distortion_coefficients", None),
            K=_numbers(content, "camera_matrix", 9),
            R=_numbers(content, "rectification_matrix", 9),
            P=_numbers(content, "projection_matrix", 12),
        )
    except KeyError as error:
        raise ValueError(f"{path}: {error} is missing") from None
    except (ValueError, yaml.YAMLError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def _size(content: dict[str, Any], name: str) -> int:
    size = content[name]
    if not (isinstance(size, int) and size > 0):
        raise ValueError(f"{name} is {size!r}, which is no number of pixels")
    return size


def _numbers(content: dict[str, Any], name: str, count: int | None) -> tuple[float, ...]:
    matrix = content[name]
    try:
        numbers = tuple(float(number) for number in matrix["data"])
    except (KeyError, TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is no matrix of numbers with rows, cols and data") from None
    if count is not None and len(numbers) != count:
        raise ValueError(f"{name} has {len(numbers)} numbers instead of {count}")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} has numbers that are not finite")
    return numbers
