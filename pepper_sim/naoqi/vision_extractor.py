"""Vision extractor: an extractor that looks at pictures of one camera (NAOqi 2.8 documentation, ALVisionExtractor)."""

from __future__ import annotations

from typing import Any, ClassVar

from pepper_sim.naoqi.extractor import Extractor
from pepper_sim.naoqi.service import ServiceError, remote, shown, within
from pepper_sim.services.al_memory import ALMemory

FASTEST = 30
"""Pictures per second, of the cameras."""
_RESOLUTIONS = (8, 7, 0, 1, 2, 3)
"""QQQQVGA to 4VGA, as ALVideoDevice numbers them."""
_QVGA = 1


class VisionExtractor(Extractor):
    """Base of the extractors that look. One that is paused keeps its subscribers and raises no events."""

    cameras: ClassVar[tuple[int, ...]] = (0, 1)
    """The cameras it may use, the first at the start."""

    def __init__(self, memory: ALMemory) -> None:
        super().__init__(memory)
        self._frame_rates: dict[str, int] = {}
        self._resolution, self._camera, self._paused = _QVGA, self.cameras[0], False

    @property
    def active(self) -> bool:
        """Whether anybody has subscribed and nobody has paused it."""
        return super().active and not self._paused

    @remote("b(si)", "b(i)")
    def setFrameRate(self, subscribedName: str | int, framerate: int | None = None) -> bool:
        """Sets how many pictures per second a subscriber, or every subscriber, wants; false if that cannot be."""
        rate = subscribedName if framerate is None else framerate
        with self._subscribers_lock:
            names = list(self._subscribers) if framerate is None else [str(subscribedName)]
            if not 1 <= int(rate) <= FASTEST or any(name not in self._subscribers for name in names):
                return False
            self._frame_rates = {name: rate for name, rate in self._frame_rates.items() if name in self._subscribers}
            self._frame_rates.update(dict.fromkeys(names, int(rate)))
        return True

    @remote("i()")
    def getFrameRate(self) -> int:
        """Returns the pictures per second that the fastest subscriber wants."""
        with self._subscribers_lock:
            rates = [
                self._frame_rates.get(name, min(FASTEST, max(1, 1000 // period)))
                for name, (period, _) in self._subscribers.items()
            ]
        return max(rates, default=FASTEST)

    @remote("b(i)")
    def setResolution(self, resolution: int) -> bool:
        """Chooses the pictures' resolution, numbered as by ALVideoDevice; false if there is none of that number."""
        if resolution not in _RESOLUTIONS:
            return False
        self._resolution = resolution
        return True

    @remote("i()")
    def getResolution(self) -> int:
        """Returns the pictures' resolution."""
        return self._resolution

    @remote("b(i)")
    def setActiveCamera(self, cameraId: int) -> bool:
        """Chooses the camera, numbered as by ALVideoDevice; false if it cannot be used."""
        if cameraId not in self.cameras:
            return False
        self._camera = cameraId
        return True

    @remote("i()")
    def getActiveCamera(self) -> int:
        """Returns the camera's number."""
        return self._camera

    @remote("v(b)")
    def pause(self, paused: bool) -> None:
        """Pauses the extractor, or lets it go on."""
        self._paused = paused
        self.subscribers_changed()

    @remote("b()")
    def isPaused(self) -> bool:
        """Whether it is paused."""
        return self._paused

    @remote("b()")
    def isProcessing(self) -> bool:
        """Whether anybody has subscribed, paused or not."""
        return bool(self._subscribers)

    @remote("v(sm)")
    def setParameter(self, paramName: str, paramValue: Any) -> None:
        """Old form of setResolution and pause: paramName is "resolution" or "pause"."""
        if not isinstance(paramValue, bool | int):
            raise ServiceError(f"paramValue must be a number, got {shown(paramValue)}")
        if paramName == "resolution":
            if not self.setResolution(int(paramValue)):
                raise ServiceError(f"there is no resolution {paramValue}")
        elif paramName == "pause":
            self.pause(bool(within(paramValue, 0, 1, "paramValue")))
        else:
            raise ServiceError(f"paramName {shown(paramName)} is unknown; known: resolution, pause")
