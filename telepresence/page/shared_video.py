"""One VP8 encoder for all who look at one source of pictures: a further viewer costs its packets and nothing else.

Encoded pictures go to every viewer as `av.Packet`, which aiortc's senders only pack (rtcrtpsender.py, since its pull
request 559). A viewer that asks for a key picture, having lost one, makes the one encoder send it, for all.
"""

from __future__ import annotations

import asyncio
import contextlib
import fractions
import logging
import math
import time
from collections import deque
from collections.abc import Callable

import av
import numpy as np
from aiortc import MediaStreamTrack
from aiortc.mediastreams import MediaStreamError
from av.video.frame import PictureType

from telepresence.video.images import LatestImage

log = logging.getLogger(__name__)

TIME_BASE = fractions.Fraction(1, 90000)
"""One tick of RTP's clock for video [s] (RFC 7741, 4.1)."""
BIT_RATE = 1_500_000
"""[bits/s]: 640x480 at 30 pictures/s look good, and an hour is 0.7 GB."""
OLDEST = 1.0
"""[s] since a picture was taken after which nobody begins with it: its camera may have died since."""
KEY_PERIOD = 0.5
"""[s] between two key pictures that viewers ask for: one with a bad decoder must not make everybody pay."""
MOST_WAITING = 2
"""Encoded pictures that wait for a viewer's network; then it gets the next key picture instead."""
_OPTIONS = {
    "deadline": "realtime",
    "cpu-used": "8",
    "lag-in-frames": "0",
    "error-resilient": "default",
    "static-thresh": "1",
    "quality": "realtime",
}


def rtp_time(stamp: float) -> int:
    """Return RTP's time of a picture, before a sender's own offset: all encoders of a source have the same."""
    return round(stamp / TIME_BASE) & 0xFFFFFFFF


class SharedVideo:
    """Encodes the newest pictures of a source while somebody looks. All of it belongs to one event loop.

    Args:
        source: Pictures as `telepresence.video.webrtc.planes_of` makes them, stamped with the time they were taken.
        watch: Told whether anybody looks.
        bit_rate: [bits/s].
        shrink: The part of the width and of the height that is left out of the pictures: 2 halves them.
        rate: Most pictures per second.
    """

    def __init__(
        self,
        source: LatestImage,
        watch: Callable[[bool], None],
        bit_rate: int = BIT_RATE,
        shrink: int = 1,
        rate: float = math.inf,
    ) -> None:
        self._source, self._watch, self._bit_rate = source, watch, bit_rate
        self._shrink, self._period = shrink, 1.0 / rate
        self._viewers: set[ViewerTrack] = set()
        self._news = asyncio.Event()
        self._task: asyncio.Task | None = None
        self._key_wanted, self._key_at = True, 0.0
        self._odd = ""

    @property
    def viewers(self) -> int:
        """How many look now."""
        return len(self._viewers)

    def track(self) -> ViewerTrack:
        """Return a track for one more viewer."""
        return ViewerTrack(self)

    def come(self, track: ViewerTrack) -> None:
        """Send this viewer what is encoded from now on, beginning with a key picture."""
        self._viewers.add(track)
        if self._task is None:
            self._watch(True)
            self._task = asyncio.ensure_future(self._encode())
        self.ask_for_key_picture()

    def ask_for_key_picture(self) -> None:
        """Let a decoder that has lost a picture begin again."""
        self._key_wanted = True

    def leave(self, track: ViewerTrack) -> None:
        """Send nothing more to this viewer; without any, nothing is encoded."""
        self._viewers.discard(track)
        if not self._viewers and self._task is not None:
            self._task.cancel()
            self._task = None
            self._watch(False)

    async def _encode(self) -> None:
        loop = asyncio.get_running_loop()

        def notify() -> None:  # on the source's thread
            with contextlib.suppress(RuntimeError):  # the loop may have ended since
                loop.call_soon_threadsafe(self._news.set)

        self._source.add_listener(notify)
        encoder: av.VideoCodecContext | None = None
        sequence, due, began = self._source.begin(OLDEST), 0.0, time.monotonic()
        try:
            while True:
                self._news.clear()
                picture = self._source.peek()
                if picture is None or picture.sequence == sequence:
                    await self._news.wait()
                    continue
                sequence, now = picture.sequence, time.monotonic()
                if now < due:
                    continue
                due = max(due + self._period, now - self._period)
                width, height = self._size(picture.content)
                try:
                    if encoder is None or (encoder.width, encoder.height) != (width, height):
                        encoder = self._open(width, height)
                    frame = av.VideoFrame.from_ndarray(picture.content, format="yuv420p")
                    # Its own clock, as the one of the pictures may be set back.
                    frame.pts, frame.time_base = round((now - began) / TIME_BASE), TIME_BASE
                    if self._key_wanted and time.monotonic() - self._key_at >= KEY_PERIOD:
                        frame.pict_type = PictureType.I
                        self._key_wanted, self._key_at = False, time.monotonic()
                    packets = await loop.run_in_executor(None, self._encoded, encoder, frame)
                except (av.FFmpegError, ValueError) as error:  # a camera's; its next picture may be another
                    self._note_odd(f"{width}x{height}: {error}")
                    encoder = None
                    continue
                for packet in packets:
                    packet.pts = rtp_time(picture.stamp)
                    for viewer in tuple(self._viewers):
                        viewer.put(packet, picture.stamp)
        finally:
            self._source.remove_listener(notify)

    def _note_odd(self, problem: str) -> None:
        if problem != self._odd:
            self._odd = problem
            log.warning("a picture cannot be encoded, and is left out: %s", problem)

    def _size(self, planes: np.ndarray) -> tuple[int, int]:
        height, width = planes.shape[0] * 2 // 3, planes.shape[1]
        return width // self._shrink // 2 * 2, height // self._shrink // 2 * 2

    def _encoded(self, encoder: av.VideoCodecContext, frame: av.VideoFrame) -> list[av.Packet]:
        """Encode a picture; on a thread."""
        if (frame.width, frame.height) != (encoder.width, encoder.height):
            kind, pts = frame.pict_type, frame.pts
            frame = frame.reformat(encoder.width, encoder.height)
            frame.pict_type, frame.pts, frame.time_base = kind, pts, TIME_BASE
        return encoder.encode(frame)

    def _open(self, width: int, height: int) -> av.VideoCodecContext:
        encoder = av.VideoCodecContext.create("libvpx", "w")
        encoder.width, encoder.height = width, height
        encoder.pix_fmt, encoder.time_base, encoder.bit_rate = "yuv420p", TIME_BASE, self._bit_rate
        encoder.gop_size, encoder.thread_count = 3000, 1
        rate = str(self._bit_rate)  # the three alike: a constant rate
        encoder.options = _OPTIONS | {"minrate": rate, "maxrate": rate, "bufsize": str(self._bit_rate // 2)}
        return encoder


class ViewerTrack(MediaStreamTrack):
    """What one viewer gets: encoded pictures, at most `MOST_WAITING` of them waiting.

    Attributes:
        sent: When the newest picture that was handed over was taken [s since 1970]; None before the first.
        waits: Whether all of it has been sent.
    """

    kind = "video"

    def __init__(self, video: SharedVideo) -> None:
        super().__init__()
        self._video = video
        self._packets: deque[tuple[av.Packet, float]] = deque()
        self._news = asyncio.Event()
        self._needs_key = True
        self.sent: float | None = None
        self.waits = False
        video.come(self)

    @property
    def video(self) -> SharedVideo:
        """What it shows."""
        return self._video

    def look_at(self, video: SharedVideo) -> None:
        """Show another form of the same pictures, from its next key picture on."""
        if video is self._video or self.readyState != "live":
            return
        before, self._video = self._video, video
        video.come(self)  # first, so that the source goes on
        before.leave(self)
        self._packets.clear()
        self._needs_key = True

    def ask_for_key_picture(self) -> None:
        """Let the viewer's decoder begin again."""
        self._video.ask_for_key_picture()

    def put(self, packet: av.Packet, stamp: float) -> None:
        """Queue an encoded picture, unless the viewer cannot use it."""
        if self._needs_key and not packet.is_keyframe:
            self._video.ask_for_key_picture()
            return
        if len(self._packets) >= MOST_WAITING:  # a delta cannot be left out alone
            self._packets.clear()
            self._needs_key = True
            self._video.ask_for_key_picture()
            return
        self._needs_key = False
        self._packets.append((packet, stamp))
        self._news.set()

    async def recv(self) -> av.Packet:
        self.waits = True
        while not self._packets:
            if self.readyState != "live":
                raise MediaStreamError
            self._news.clear()
            await self._news.wait()
        self.waits = False
        packet, self.sent = self._packets.popleft()
        return packet

    def stop(self) -> None:
        super().stop()
        self._video.leave(self)
        self._news.set()
