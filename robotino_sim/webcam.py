"""Robotino's webcam for its web server: the newest JPEG, drawn only while clients request it.

Sources: camd2 and restapid (mirror BusHero/robotino_api2): 320x240 by default, other sizes configurable; the camera is
released about ten seconds after the last request.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Sequence

from robotino_sim.robot import Robotino
from telepresence.sim.camera import CamerasFailed, Feed
from telepresence.video.images import LatestImage
from telepresence.video.jpeg import encode_jpeg

log = logging.getLogger(__name__)

SIZES = ((160, 120), (320, 240), (640, 480), (800, 600))
"""Sizes that camd2 offers (width, height) [px]."""
DEFAULT_SIZE = (320, 240)
RATE = 30.0
"""Pictures per second."""
IDLE_RELEASE = 10.0
"""Seconds after the last request until the camera is released."""
_MAX_AGE = 1.0


class Webcam:
    """Draws and encodes on a thread of its own while pictures are requested; `jpeg` never waits.

    Args:
        size: One of `SIZES`.
        idle_release: Seconds after the last request until drawing stops.
    Raises:
        ValueError: A size that the camera does not have.
    """

    def __init__(self, robot: Robotino, size: Sequence[int] = DEFAULT_SIZE, idle_release: float = IDLE_RELEASE) -> None:
        if tuple(size) not in SIZES:  # a ROS parameter is a list
            raise ValueError(f"the camera has no size {size}; sizes: {', '.join(f'{w}x{h}' for w, h in SIZES)}")
        self.image = LatestImage()
        self.size = size[0], size[1]
        self._robot = robot
        self._idle_release = idle_release
        self._last_request = -idle_release
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="webcam", daemon=True)
        self._thread.start()

    @property
    def awake(self) -> bool:
        """Whether a picture was requested lately."""
        return time.monotonic() - self._last_request < self._idle_release

    def wake(self) -> None:
        """Request pictures: draw from now on."""
        with self._changed:
            self._last_request = time.monotonic()
            self._changed.notify()

    def jpeg(self) -> tuple[bytes, int] | None:
        """Return the newest picture and its number if one was drawn during the last second, else None."""
        picture = self.image.peek()
        if picture is None or self.image.age() > _MAX_AGE:
            return None
        return picture.content, picture.sequence

    def close(self) -> None:
        """Stop the thread. Calling it again does nothing."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=10.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self.awake or self._closed):
                    self._changed.wait()
                if self._closed:
                    return
            try:
                with self._robot.subscribe_camera(*self.size, RATE) as feed:
                    self._encode(feed)
            except (CamerasFailed, RuntimeError) as error:
                log.error("the camera has no picture: %s", error)
                with self._changed:
                    self._changed.wait_for(lambda: self._closed, timeout=5.0)
            except Exception:  # the top of a thread: whatever it is, it must be in the log
                log.exception("the camera failed")
                return

    def _encode(self, feed: Feed) -> None:
        sequence = 0
        while self.awake and not self._closed:
            picture = feed.image.wait_newer(sequence, timeout=0.2)
            if picture is None:
                continue
            sequence = picture.sequence
            self.image.put(encode_jpeg(picture.content), picture.stamp)
