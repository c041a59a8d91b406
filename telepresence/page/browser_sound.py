"""One browser's sound: it listens to the robot, and its microphone speaks through the robot while it has the robot."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from aiortc import RTCRtpTransceiver

from telepresence.audio.webrtc_sound import RATE, listen
from telepresence.page.shared_sound import SharedSound

FRESH = 0.3
"""[s] after a piece of a microphone for which it counts as open."""
_STEREO = 2


class BrowserSound:
    """One connection's sound both ways. All of it belongs to one event loop.

    Args:
        sound: Of the robot.
        speak: Lets the robot say a piece: int16 little-endian, mono, `RATE`.
        allowed: Whether this browser may speak, now.
    """

    def __init__(self, sound: SharedSound, speak: Callable[[bytes, int, int], None], allowed: Callable[[], bool]):
        self._speak, self._allowed = speak, allowed
        self._track = sound.track()
        self._receiver: Any = None
        self._task: asyncio.Task | None = None
        self._spoke = -FRESH

    def join(self, transceiver: RTCRtpTransceiver) -> None:
        """Use this place of the connection."""
        transceiver.sender.replaceTrack(self._track)
        transceiver.direction = "sendrecv"
        self._receiver = transceiver.receiver
        self._task = asyncio.ensure_future(listen(self._receiver.track, self._take))

    def check(self) -> None:
        """Open or close the way in; ten times a second."""
        if self._receiver is not None:
            self._receiver._enabled = self._allowed()  # what others send is not even decoded; no public name

    @property
    def listens(self) -> bool:
        """Whether the browser gets the robot's sound."""
        return self._track.listens

    @listens.setter
    def listens(self, wanted: bool) -> None:
        self._track.listens = wanted

    @property
    def speaks(self) -> bool:
        """Whether the browser's microphone comes through."""
        return time.monotonic() - self._spoke < FRESH

    def close(self) -> None:
        """The connection is over."""
        self._track.stop()
        if self._task is not None:
            self._task.cancel()

    def _take(self, frames: bytes) -> None:
        if self._allowed():
            self._spoke = time.monotonic()
            mono: np.ndarray = np.frombuffer(frames, "<i2")[::_STEREO]
            self._speak(mono.tobytes(), RATE, 1)
