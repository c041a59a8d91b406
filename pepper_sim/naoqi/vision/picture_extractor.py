"""Extractors that look at pictures: a thread runs while somebody has subscribed, and not otherwise."""

from __future__ import annotations

import logging
import threading
import time
from abc import ABC, abstractmethod
from typing import ClassVar

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.video.streams import Cursor
from pepper_sim.naoqi.vision.pictures import Picture
from pepper_sim.naoqi.vision_extractor import VisionExtractor
from pepper_sim.services.al_memory import ALMemory
from pepper_sim.services.al_video_device import ALVideoDevice

log = logging.getLogger(__name__)

RGB, DEPTH = 11, 17
"""Colour spaces of ALVideoDevice: red, green, blue; millimetres from the image plane."""
_SHORTEST_PERIOD = 1.0 / 15.0
"""Time between two pictures [s]: more than that the robot's own processor does not look at either."""
_END_TIMEOUT = 3.0


class PictureExtractor(Extractor, ABC):
    """Base of the extractors that look at pictures. A subclass says at which, and what it sees in them.

    Attributes:
        camera, resolution, space: Numbers of ALVideoDevice.
    """

    camera: ClassVar[int] = 0
    resolution: ClassVar[int] = 2
    space: ClassVar[int] = RGB

    def __init__(self, memory: ALMemory, video: ALVideoDevice) -> None:
        super().__init__(memory)
        self._video = video
        self._thread_lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._awake = threading.Event()
        self._ending = False

    @abstractmethod
    def detect(self, picture: Picture) -> None:
        """Find something in a picture; called on the extractor's own thread."""

    def nobody_looks(self) -> None:
        """Called when the last subscriber has left: what was seen before is forgotten."""

    def view(self) -> tuple[int, int, float]:
        """Return camera, resolution and the time between two pictures [s]."""
        return self.camera, self.resolution, self.getCurrentPeriod() / 1000.0

    def subscribers_changed(self) -> None:
        with self._thread_lock:
            if self.active and self._thread is None and not self._ending:
                self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
                self._thread.start()
            self._awake.set()

    def close(self) -> None:
        with self._thread_lock:
            self._ending = True
            thread = self._thread
            self._awake.set()
        if thread is not None:
            thread.join(timeout=_END_TIMEOUT)
        super().close()

    def _run(self) -> None:
        cursor = Cursor()
        try:
            while self._goes_on():
                began = time.monotonic()
                camera, resolution, period = self.view()
                period = max(period, _SHORTEST_PERIOD)
                picture = self._video.picture(camera, resolution, self.space, 1.0 / period, cursor)
                if picture is not None:
                    self.detect(picture)
                self._awake.wait(max(0.0, began + period - time.monotonic()))
        except Exception:  # top of a thread; the next subscription starts another one
            log.exception("%s looks no longer", self.name)
            with self._thread_lock:
                self._thread = None
        self.nobody_looks()

    def _goes_on(self) -> bool:
        with self._thread_lock:
            self._awake.clear()
            if self.active and not self._ending:
                return True
            self._thread = None
            return False


class AdjustableExtractor(PictureExtractor, VisionExtractor):
    """Base of those whose camera, resolution and rate clients choose."""

    def view(self) -> tuple[int, int, float]:
        return self.getActiveCamera(), self.getResolution(), 1.0 / self.getFrameRate()
