"""ALVideoDevice: between places in a picture and angles seen from the camera.

Places and sizes in a picture are parts of its width and height, from the top left; angles are [rad].
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pepper_sim.naoqi.service import ServiceError, finite, one_of, remote, within
from pepper_sim.naoqi.video.formats import RESOLUTIONS
from pepper_sim.naoqi.video.streams import Camera

_STEEPEST = 1.5


def known_camera(cameras: Mapping[int, Camera], index: int) -> Camera:
    """Return the camera with this index.

    Raises: ServiceError: There is no such camera.
    """
    if index not in cameras:
        raise ServiceError(f"there is no camera {index}; cameras: {', '.join(map(str, cameras))}")
    return cameras[index]


class VideoConversions:
    """Conversion part of ALVideoDevice."""

    def __init__(self, cameras: Mapping[int, Camera]) -> None:
        self._cameras = cameras

    @remote("[f](i[f])")
    def getAngularPositionFromImagePosition(self, cameraIndex: int, imagePosition: list[float]) -> list[float]:
        """Turns a place in the picture (0 to 1) into angles [yaw, pitch]."""
        tangents = self._tangents(cameraIndex)
        x, y = _numbers(imagePosition, 2, "imagePosition")
        return [math.atan((1 - 2 * x) * tangents[0]), math.atan((2 * y - 1) * tangents[1])]

    @remote("[f](i[f])")
    def getImagePositionFromAngularPosition(self, cameraIndex: int, angularPosition: list[float]) -> list[float]:
        """Turns angles [yaw, pitch] into a place in the picture."""
        tangents = self._tangents(cameraIndex)
        yaw, pitch = _numbers(angularPosition, 2, "angularPosition", _STEEPEST)
        return [(1 - math.tan(yaw) / tangents[0]) / 2, (1 + math.tan(pitch) / tangents[1]) / 2]

    @remote("[f](i[f])")
    def getAngularSizeFromImageSize(self, cameraIndex: int, imageSize: list[float]) -> list[float]:
        """Turns a size in the middle of the picture (0 to 1) into angles [width, height]."""
        tangents = self._tangents(cameraIndex)
        sizes = _numbers(imageSize, 2, "imageSize", 1.0, 0.0)
        return [2 * math.atan(size * tangent) for size, tangent in zip(sizes, tangents, strict=True)]

    @remote("[f](i[f])")
    def getImageSizeFromAngularSize(self, cameraIndex: int, angularSize: list[float]) -> list[float]:
        """Turns angles [width, height] into a size in the middle of the picture."""
        tangents = self._tangents(cameraIndex)
        angles = _numbers(angularSize, 2, "angularSize", 2 * _STEEPEST, 0.0)
        return [math.tan(angle / 2) / tangent for angle, tangent in zip(angles, tangents, strict=True)]

    @remote("[f](i[f])")
    def getImageInfoFromAngularInfo(self, cameraIndex: int, angularInfo: list[float]) -> list[float]:
        """Turns a direction and angular sizes, as extractors return them, into [x, y, width, height]."""
        info = _numbers(angularInfo, 4, "angularInfo", 2 * _STEEPEST)
        place = self.getImagePositionFromAngularPosition(cameraIndex, info[:2])
        return [*place, *self.getImageSizeFromAngularSize(cameraIndex, info[2:])]

    @remote("[f](i[f]i)")
    def getImageInfoFromAngularInfoWithResolution(
        self, cameraIndex: int, angularInfo: list[float], resolutionIndex: int
    ) -> list[float]:
        """Turns a direction and angular sizes into [x, y, width, height] in pixels."""
        width, height = RESOLUTIONS[one_of(resolutionIndex, RESOLUTIONS, "resolutionIndex")]
        x, y, across, down = self.getImageInfoFromAngularInfo(cameraIndex, angularInfo)
        return [x * width, y * height, across * width, down * height]

    def _tangents(self, camera: int) -> tuple[float, float]:
        found = known_camera(self._cameras, camera)
        return math.tan(found.fovx / 2), math.tan(found.fovy / 2)


def _numbers(values: list[float], count: int, name: str, most: float = math.inf, least: float | None = None) -> list:
    if len(values) != count:
        raise ServiceError(f"{name} must hold {count} numbers, got {len(values)}")
    return [within(finite(value, name), -most if least is None else least, most, name) for value in values]
