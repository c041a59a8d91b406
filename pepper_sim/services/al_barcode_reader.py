"""ALBarcodeReader: QR codes in the picture (NAOqi 2.8 documentation, albarcodereader), read by OpenCV."""

from __future__ import annotations

import cv2
import numpy as np

from pepper_sim.naoqi.vision.picture_extractor import AdjustableExtractor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

EVENT = "BarcodeReader/BarcodeDetected"
_VGA = 2


class ALBarcodeReader(AdjustableExtractor):
    """Reads QR codes."""

    name = "ALBarcodeReader"
    events = (EVENT,)

    def __init__(self, memory: ALMemory, video: ALVideoDevice) -> None:
        super().__init__(memory, video)
        self._resolution = _VGA
        self._detector = cv2.QRCodeDetectorAruco()

    def detect(self, picture: Picture) -> None:
        grey = cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2GRAY)
        found, texts, corners, _ = self._detector.detectAndDecodeMulti(grey)
        # OpenCV's corners run clockwise from the one opposite to the corner without a square; NAOqi's the other way.
        pairs = zip(texts, np.asarray(corners), strict=True) if found else ()
        codes = [[text, places[[0, 3, 2, 1]].tolist()] for text, places in pairs if text]
        if codes:
            self.memory.announce(EVENT, codes)
