"""One browser's camera: the face of who has the robot, as JPEG for the robot's tablet."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import av
from aiortc import RTCRtpTransceiver

from telepresence.video.bounded_decoding import bound
from telepresence.video.jpeg import encode_jpeg
from telepresence.video.webrtc import drain

PERIOD = 1 / 20
"""Seconds between two pictures at least; the page sends 15 a second."""
PAUSED = 1.0
"""Seconds without a picture after which the camera counts as covered."""
COVERED_PERIOD = 0.5
"""Seconds between two notices that it is."""
MOST_WIDTH, MOST_HEIGHT = 640, 480
"""[pixel]"""
MAX_PIXELS = 1 << 20
"""Of a camera's picture; the page asks for 640x480, and some cameras have nothing below 1280x720."""
MAX_WAITING = 8
"""Pictures that wait to be decoded: half a second."""


class BrowserFace:
    """One connection's camera. All of it belongs to one event loop.

    Args:
        show: Shows the robot's people a picture (JPEG), b"" for a covered camera, or None: no face any more.
        allowed: Whether this browser may be seen, now.
    """

    def __init__(self, show: Callable[[bytes | None], None], allowed: Callable[[], bool]) -> None:
        self._show, self._allowed = show, allowed
        self.wanted = self._shown = False
        """Whether the page wants the face to be shown."""
        self._newest = self._covered = 0.0
        self._receiver: Any = None
        self._task: asyncio.Task | None = None
        self._encoding: asyncio.Future | None = None

    def join(self, transceiver: RTCRtpTransceiver) -> None:
        """Use this place of the connection."""
        transceiver.direction = "recvonly"
        self._receiver = transceiver.receiver
        bound(self._receiver, MAX_PIXELS, MAX_WAITING)
        self._task = asyncio.ensure_future(drain(self._receiver.track, self._take))

    @property
    def live(self) -> bool:
        """Whether pictures come through."""
        return self._shown and time.monotonic() - self._newest < PAUSED

    def want(self, wanted: bool) -> None:
        """Show the face, or do not."""
        self.wanted = wanted
        self._newest = time.monotonic()  # the camera may take a moment
        self.check()

    def check(self) -> None:
        """Open or close the way in, and say that the camera is covered; ten times a second.

        Who loses the robot wants nothing any more: their page cannot withdraw it, since the station takes requests
        only of who has the robot, and it would count again when the robot comes back.
        """
        if not self._allowed():
            self.wanted = False
        wanted = self.wanted
        if self._receiver is not None:
            self._receiver._enabled = wanted  # what others send is not even decoded; no public name
        if self._shown and not wanted:
            self._shown = False
            self._show(None)
        now = time.monotonic()
        if wanted and now - self._newest > PAUSED and now - self._covered > COVERED_PERIOD:
            self._shown, self._covered = True, now
            self._show(b"")

    def close(self) -> None:
        """The connection is over."""
        self.wanted = False
        self.check()
        if self._task is not None:
            self._task.cancel()

    def _take(self, frame: av.VideoFrame) -> None:
        now = time.monotonic()
        if not (self.wanted and self._allowed()) or now - self._newest < PERIOD:
            return
        if self._encoding is not None and not self._encoding.done():
            return  # a busy machine shows fewer pictures
        self._newest, self._shown = now, True
        self._encoding = asyncio.get_running_loop().run_in_executor(None, _jpeg, frame)
        self._encoding.add_done_callback(self._on_encoded)

    def _on_encoded(self, encoded: asyncio.Future[bytes]) -> None:
        if not encoded.cancelled() and self._shown and self.wanted:
            self._show(encoded.result())


def _jpeg(frame: av.VideoFrame) -> bytes:
    scale = min(1.0, MOST_WIDTH / frame.width, MOST_HEIGHT / frame.height)
    width, height = (max(2, round(side * scale)) for side in (frame.width, frame.height))
    return encode_jpeg(frame.reformat(width, height, "rgb24").to_ndarray())
