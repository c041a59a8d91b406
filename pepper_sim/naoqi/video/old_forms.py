"""ALVideoDevice: methods of older releases, which 2.5 documents as deprecated; they act on the active camera."""

from __future__ import annotations

from collections.abc import Callable

from pepper_sim.naoqi.service import ServiceError, one_of, remote
from pepper_sim.naoqi.video.conversions import VideoConversions
from pepper_sim.naoqi.video.formats import RESOLUTIONS
from pepper_sim.naoqi.video.multi_stream import CameraView
from pepper_sim.naoqi.video.settings import VideoSettings


class OldVideoForms:
    """Part of ALVideoDevice.

    Args:
        view_of: Subscription handle -> its first camera; raises ServiceError for an unknown one.
        rate_of: Subscription handle -> its pictures per second.
    """

    def __init__(
        self,
        settings: VideoSettings,
        conversions: VideoConversions,
        view_of: Callable[[str], CameraView],
        rate_of: Callable[[str], int],
    ) -> None:
        self._settings, self._conversions = settings, conversions
        self._view_of, self._rate_of = view_of, rate_of

    # --- the driver's and a subscription's format --------------------------------------------------------------------

    @remote("i()")
    def getVIMResolution(self) -> int:
        """Returns the active camera's resolution."""
        return self._settings.getResolution(self._settings.active)

    @remote("i()")
    def getVIMColorSpace(self) -> int:
        """Returns the active camera's colour space."""
        return self._settings.getColorSpace(self._settings.active)

    @remote("i()")
    def getVIMFrameRate(self) -> int:
        """Returns the active camera's pictures per second."""
        return self._settings.getFrameRate(self._settings.active)

    @remote("i(s)")
    def getGVMResolution(self, id: str) -> int:
        """Returns the resolution of a subscription."""
        return self._view_of(id).resolution

    @remote("i(s)")
    def getGVMColorSpace(self, id: str) -> int:
        """Returns the colour space of a subscription."""
        return self._view_of(id).space

    @remote("i(s)")
    def getGVMFrameRate(self, id: str) -> int:
        """Returns a subscription's pictures per second."""
        return self._rate_of(id)

    # --- cameras -----------------------------------------------------------------------------------------------------

    @remote("i()")
    def getCameraModelID(self) -> int:
        """Returns the active camera's sensor."""
        return self._settings.getCameraModel(self._settings.active)

    @remote("b()")
    def startFrameGrabber(self) -> bool:
        """Starts the active camera."""
        return self._settings.startCamera(self._settings.active)

    @remote("b()")
    def stopFrameGrabber(self) -> bool:
        """Stops the active camera."""
        return self._settings.stopCamera(self._settings.active)

    @remote("b()")
    def isFrameGrabberOff(self) -> bool:
        """Whether the active camera is stopped."""
        return not self._settings.isCameraStarted(self._settings.active)

    @remote("f(i)")
    def getHorizontalAperture(self, cameraIndex: int) -> float:
        """Returns the horizontal field of view [rad]."""
        return self._settings.getHorizontalFOV(cameraIndex)

    @remote("f(i)")
    def getVerticalAperture(self, cameraIndex: int) -> float:
        """Returns the vertical field of view [rad]."""
        return self._settings.getVerticalFOV(cameraIndex)

    @remote("m(i)")
    def resolutionToSizes(self, resolution: int) -> list[int]:
        """Returns the width and height of a resolution [px]."""
        return list(RESOLUTIONS[one_of(resolution, RESOLUTIONS, "resolution")])

    @remote("i(ii)")
    def sizesToResolution(self, width: int, height: int) -> int:
        """Returns the resolution of a width and height [px]; -1 if there is none."""
        return next((number for number, size in RESOLUTIONS.items() if size == (width, height)), -1)

    # --- for NAOqi's own simulator -----------------------------------------------------------------------------------

    @remote("b(iiim)", "b(iim)")
    def putImage(self, cameraIndex: int, width: int, height: int, imageBuffer: object = None) -> bool:
        """Replaces a camera's picture; as on a robot, it does not: its pictures come from its cameras."""
        raise ServiceError("only works in simulation: this robot's pictures come from its cameras")

    @remote("m(i)", "m()")
    def getExpectedImageParameters(self, cameraIndex: int | None = None) -> list[int]:
        """Returns [height, width, pictures per second] of a camera."""
        index = self._settings.active if cameraIndex is None else cameraIndex
        width, height = RESOLUTIONS[self._settings.getResolution(index)]
        return [height, width, self._settings.getFrameRate(index)]

    # --- conversion --------------------------------------------------------------------------------------------------

    @remote("[f]([f])")
    def getAngPosFromImgPos(self, imgPos: list[float]) -> list[float]:
        """Turns a place in the picture into angles."""
        return self._conversions.getAngularPositionFromImagePosition(self._settings.active, imgPos)

    @remote("[f]([f])")
    def getImgPosFromAngPos(self, angPos: list[float]) -> list[float]:
        """Turns angles into a place in the picture."""
        return self._conversions.getImagePositionFromAngularPosition(self._settings.active, angPos)

    @remote("[f]([f])")
    def getAngSizeFromImgSize(self, imgSize: list[float]) -> list[float]:
        """Turns a size in the picture into angles."""
        return self._conversions.getAngularSizeFromImageSize(self._settings.active, imgSize)

    @remote("[f]([f])")
    def getImgSizeFromAngSize(self, angSize: list[float]) -> list[float]:
        """Turns angles into a size in the picture."""
        return self._conversions.getImageSizeFromAngularSize(self._settings.active, angSize)

    @remote("[f]([f])")
    def getImgInfoFromAngInfo(self, angInfo: list[float]) -> list[float]:
        """Turns a direction and angular sizes into [x, y, width, height]."""
        return self._conversions.getImageInfoFromAngularInfo(self._settings.active, angInfo)

    @remote("[f]([f]i)")
    def getImgInfoFromAngInfoWithRes(self, angInfo: list[float], res: int) -> list[float]:
        """Turns a direction and angular sizes into [x, y, width, height] in pixels."""
        return self._conversions.getImageInfoFromAngularInfoWithResolution(self._settings.active, angInfo, res)
