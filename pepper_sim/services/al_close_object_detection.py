"""ALCloseObjectDetection: what is too close for the depth camera (NAOqi 2.1 and 2.8 documentation).

Such objects saturate the infrared picture, which the head 1.8 does not have: there nothing is ever detected, as
documented.
"""

from __future__ import annotations

import cv2
import numpy as np

from pepper_sim.naoqi.video.formats import INFRARED_SATURATED
from pepper_sim.naoqi.vision.picture_extractor import PictureExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_video_device import ALVideoDevice

DETECTED, LOST = "CloseObjectDetection/ObjectDetected", "CloseObjectDetection/ObjectNotDetected"
TRACKED, INFO = "ALTracker/CloseObjectDetected", "CloseObjectDetection/ObjectInfo"
_INFRARED = 20
_LEAST_PIXELS = 200
_NEAREST = 0.4
"""Where the depth camera begins to see; what is closer is taken to be half as far away [m]."""


class ALCloseObjectDetection(PictureExtractor):
    """Detects what is right before the depth camera."""

    name = "ALCloseObjectDetection"
    events = (DETECTED, LOST, TRACKED)
    camera, resolution, space = 2, 1, _INFRARED
    _seen = False

    @property
    def active(self) -> bool:
        return super().active and _has_infrared(self._video)

    def detect(self, picture: Picture) -> None:
        saturated = (picture.pixels >= INFRARED_SATURATED).astype(np.uint8)
        _, _, boxes, centres = cv2.connectedComponentsWithStats(saturated, connectivity=8)
        label = int(np.argmax(boxes[1:, cv2.CC_STAT_AREA])) + 1 if len(boxes) > 1 else 0
        if not label or boxes[label, cv2.CC_STAT_AREA] < _LEAST_PIXELS:
            self.nobody_looks()
            return
        x, y, width, height, amount = map(int, boxes[label])
        centre = float(centres[label][0]), float(centres[label][1])
        shares = [amount / saturated.size, amount / (width * height)]
        info = [picture.angles(*centre), picture.box(x, y, width, height), shares]
        self._seen = True
        self.memory.store(INFO, [picture.time_stamp, info, *picture.origin])
        self.memory.announce(DETECTED, 1)
        self.memory.announce(TRACKED, picture.target(*centre, _NEAREST / 2.0))

    def nobody_looks(self) -> None:
        if self._seen:
            self._seen = False
            self.memory.announce(LOST, 1)


def _has_infrared(video: ALVideoDevice) -> bool:
    return any(_INFRARED in camera.spaces for camera in video.settings.cameras.values())
