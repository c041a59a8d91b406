"""What ALPhotoCapture and ALVideoRecorder have in common: which camera they use, how large and in which colours."""

from __future__ import annotations

from pepper_sim.naoqi.service import Module, one_of, remote

GREY, BGR = 0, 13
"""The colour spaces that can be saved."""


class CameraChoice(Module):
    """A service that saves what a camera sees. The settings are numbered as by ALVideoDevice."""

    def __init__(self) -> None:
        self._camera, self._resolution, self._space = 0, 1, BGR

    @remote("i()")
    def getCameraID(self) -> int:
        """Returns the camera's number."""
        return self._camera

    @remote("i()")
    def getResolution(self) -> int:
        """Returns the pictures' resolution."""
        return self._resolution

    @remote("i()")
    def getColorSpace(self) -> int:
        """Returns the colour space: 13 colour, 0 grey."""
        return self._space

    @remote("v(i)")
    def setColorSpace(self, colorSpace: int) -> None:
        """Sets the colour space: 13 colour, 0 grey."""
        self._space = one_of(colorSpace, (GREY, BGR), "colorSpace")
