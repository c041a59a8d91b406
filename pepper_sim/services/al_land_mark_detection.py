"""ALLandMarkDetection: the landmarks that stand in the scene, read from the top camera's picture.

Source: NAOqi 2.8 documentation, allandmarkdetection. The marks are those of `--poster mark:NUMBER@...`, see
`pepper_sim.naoqi.vision.landmarks`.
"""

from __future__ import annotations

import cv2

from pepper_sim.naoqi.vision import landmarks
from pepper_sim.naoqi.vision.picture_extractor import PictureExtractor
from pepper_sim.naoqi.vision.pictures import Picture

EVENT = "LandmarkDetected"
_SIZES = (0.035, 0.40)
"""Smallest and largest mark that is seen [rad]."""


class ALLandMarkDetection(PictureExtractor):
    """Detects marks with numbers on them."""

    name = "ALLandMarkDetection"
    events = (EVENT,)
    _seen = False

    def detect(self, picture: Picture) -> None:
        grey = cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY)
        height, width = grey.shape
        per_pixel = picture.extent(width / 2.0, height / 2.0, 1.0, 1.0)[0]
        marks = landmarks.find(grey, *(size / per_pixel for size in _SIZES))
        if marks:
            found = [_mark_info(picture, mark) for mark in marks]
            self.memory.announce(EVENT, [picture.time_stamp, found, *picture.origin[:2], picture.camera.name])
        elif self._seen:
            self.nobody_looks()
        self._seen = bool(marks)

    def nobody_looks(self) -> None:
        if self._seen:
            self._seen = False
            self.memory.announce(EVENT, [])


def _mark_info(picture: Picture, mark: landmarks.FoundMark) -> list:
    """Return MarkInfo: the shape, and the number in a list, as programs read it."""
    size = picture.extent(mark.x, mark.y, mark.width, mark.height)
    return [[1, *picture.angles(mark.x, mark.y), *size, mark.tilt], [mark.number]]
