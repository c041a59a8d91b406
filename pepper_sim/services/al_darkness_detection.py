"""ALDarknessDetection: how dark the picture is (NAOqi 2.8 documentation, aldarknessdetection)."""

from __future__ import annotations

import cv2

from pepper_sim.naoqi.service import remote
from pepper_sim.naoqi.vision.picture_extractor import AdjustableExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

EVENT, VALUE = "DarknessDetection/DarknessDetected", "DarknessDetection/DarknessValue"
_DEFAULT_THRESHOLD = 60


class ALDarknessDetection(AdjustableExtractor):
    """Says when it becomes dark: how far the mean luminance is from white, 0 to 100."""

    name = "ALDarknessDetection"
    events = (EVENT,)

    def __init__(self, memory: ALMemory, video: ALVideoDevice) -> None:
        super().__init__(memory, video)
        self._threshold = _DEFAULT_THRESHOLD
        self._dark = False
        memory.declare((VALUE,), self.name)

    @remote("i()")
    def getDarknessThreshold(self) -> int:
        """Returns the darkness from which the event is raised, 0 to 100."""
        return self._threshold

    @remote("v(i)")
    def setDarknessThreshold(self, threshold: int) -> None:
        """Sets the darkness from which the event is raised; brought into 0 to 100."""
        self._threshold = min(max(threshold, 0), 100)

    def detect(self, picture: Picture) -> None:
        value = round(100.0 * (1.0 - float(cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY).mean()) / 255.0))
        self.memory.store(VALUE, value)
        was_dark, self._dark = self._dark, value > self._threshold
        if self._dark and not was_dark:
            self.memory.announce(EVENT, value)

    def nobody_looks(self) -> None:
        self._dark = False
