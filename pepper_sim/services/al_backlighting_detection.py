"""ALBacklightingDetection: a bright window behind a dark scene (NAOqi 2.8 documentation, albacklightingdetection)."""

from __future__ import annotations

import cv2
import numpy as np

from pepper_sim.naoqi.vision.picture_extractor import AdjustableExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

EVENT, VALUE = "BacklightingDetection/BacklightingDetected", "BacklightingDetection/BacklightingValue"
NONE, POSSIBLE, CERTAIN = 0, 1, 2
_CLIPPED, _DARK = 255, 70
"""Luminance of a pixel that counts as clipped, and below which one counts as dark."""
_CLIPPED_SHARE, _DARK_SHARE = 0.02, 0.60
_HALF = 0.5


class ALBacklightingDetection(AdjustableExtractor):
    """Says when what the camera sees is lit from behind.

    Both documented shares count alike: certain where both are exceeded, possible where the dark one is half as large.
    """

    name = "ALBacklightingDetection"
    events = (EVENT,)

    def __init__(self, memory: ALMemory, video: ALVideoDevice) -> None:
        super().__init__(memory, video)
        self._value = NONE
        memory.declare((VALUE,), self.name)

    def detect(self, picture: Picture) -> None:
        value = backlighting(cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY))
        self.memory.store(VALUE, value)
        before, self._value = self._value, value
        if value == CERTAIN != before:
            self.memory.announce(EVENT, value)

    def nobody_looks(self) -> None:
        self._value = NONE


def backlighting(grey: np.ndarray) -> int:
    """Return 0 none, 1 possible, 2 certain."""
    clipped, dark = float(np.mean(grey >= _CLIPPED)), float(np.mean(grey < _DARK))
    if clipped <= _CLIPPED_SHARE or dark <= _HALF * _DARK_SHARE:
        return NONE
    return CERTAIN if dark > _DARK_SHARE else POSSIBLE
