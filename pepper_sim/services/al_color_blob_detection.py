"""ALColorBlobDetection: the largest blob of a colour that a client names (NAOqi 2.8 documentation).

Its distance follows from its size: the client says how large the object is.
"""

from __future__ import annotations

import math

import numpy as np

from pepper_sim.naoqi.service import ServiceError, one_of, remote, within
from pepper_sim.naoqi.vision.blobs import ROUND, Blob, largest
from pepper_sim.naoqi.vision.picture_extractor import PictureExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

EVENT = "ALTracker/ColorBlobDetected"
_AUTO_EXPOSURE = 11
_SHAPES = ("Circle", "Unknown")


class ALColorBlobDetection(PictureExtractor):
    """Detects a coloured object."""

    name = "ALColorBlobDetection"
    events = (EVENT,)
    resolution = 1

    def __init__(self, memory: ALMemory, video: ALVideoDevice) -> None:
        super().__init__(memory, video)
        self._colour: tuple[int, int, int] | None = None
        self._threshold = 0
        self._object = (10, 0.06, "Unknown")
        self._circle: list[float] = []

    @remote("v(iiii)")
    def setColor(self, r: int, g: int, b: int, colorThres: int) -> None:
        """Sets the colour to find, 0 to 255 each, and how far a pixel's may be from it in each component."""
        for name, value in (("r", r), ("g", g), ("b", b), ("colorThres", colorThres)):
            within(value, 0, 255, name)
        self._colour, self._threshold = (r, g, b), colorThres

    @remote("v(ifs)", "v(if)")
    def setObjectProperties(self, minSize: int, span: float, shape: str = "Unknown") -> None:
        """Sets the least size in the picture [px], the object's real size [m] and its shape, Circle or Unknown."""
        within(minSize, 0, 10_000_000, "minSize")
        if span <= 0.0:
            raise ServiceError(f"span must be positive, got {span:g}")
        self._object = (minSize, span, one_of(shape, _SHAPES, "shape"))

    @remote("m()")
    def getCircle(self) -> list[float]:
        """Returns the circle around the blob: x, y and radius as parts of the picture; empty if none is seen."""
        return self._circle

    @remote("b()")
    def getAutoExposure(self) -> bool:
        """Whether the camera chooses the exposure."""
        return bool(self._video.settings.getParameter(self.camera, _AUTO_EXPOSURE))

    @remote("v(b)")
    def setAutoExposure(self, mode: bool) -> None:
        """Lets the camera choose the exposure, or not."""
        self._video.settings.setParameter(self.camera, _AUTO_EXPOSURE, int(mode))

    def detect(self, picture: Picture) -> None:
        blob = self._find(picture.pixels)
        if blob is None:
            self._circle = []
            return
        height, width = picture.pixels.shape[:2]
        self._circle = [blob.x / width, blob.y / height, blob.radius / width]
        focal = 0.5 * height / math.tan(0.5 * picture.camera.fovy)
        self.memory.announce(EVENT, picture.target(blob.x, blob.y, self._object[1] * focal / (2.0 * blob.radius)))

    def nobody_looks(self) -> None:
        self._circle = []

    def _find(self, pixels: np.ndarray) -> Blob | None:
        if self._colour is None:
            return None
        difference = np.abs(pixels.astype(np.int16) - np.array(self._colour, np.int16)).max(axis=2)
        least, _, shape = self._object
        return largest((difference <= self._threshold).astype(np.uint8), least, ROUND if shape == "Circle" else 0.0)
