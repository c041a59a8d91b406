"""The pilot's camera as a stream of JPEG pictures that never ends.

One thread opens the source, reads, and encodes once, unless the camera has encoded its pictures itself. When the source
is missing or lost, the stream goes on with a picture that says so in words, and the source is tried again until it is
back. While pictures come from elsewhere, they are shown in place of the source's. A camera that nobody wants is closed,
so that its light is off, and a notice says so to whoever still looks.
"""

from __future__ import annotations

import enum
import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from telepresence.video.images import LatestImage
from telepresence.video.jpeg import decode_jpeg, encode_jpeg
from telepresence_1.camera_sources import Source, SourceError, open_source
from telepresence_1.jpeg import Jpeg, completed
from telepresence_1.placeholder_images import draw_notice

log = logging.getLogger(__name__)

FIRST_PAUSE, LONGEST_PAUSE = 0.5, 1.0
"""Seconds between two attempts to open a source; doubled after every failure. A camera that is back is live within the
longest one, and what it takes to open it."""
NOTICE_PERIOD = 0.5
"""Seconds between two pictures of the notice: its clock shows that the stream lives."""
LARGEST_PASSED = 100_000
"""A picture that the camera has encoded itself goes to the viewers as it is unless it has more bytes than this: at 30
pictures/s that is 24 Mbit/s a viewer, more than Wi-Fi of the tablet's time carries."""
ELSEWHERE_LIFE = 2.0
"""[s] after the last picture from elsewhere until it counts as over."""
OFF, OFF_TEXT = "Camera off", "The pilot's camera is switched off."


class State(enum.Enum):
    OPENING = "opening"
    LIVE = "live"
    LOST = "lost"


@dataclass(frozen=True)
class CameraStatus:
    """`text` is for people; `rate` [pictures/s], `width` and `height` are of the last second, 0 when not live."""

    state: State
    text: str
    source: str
    rate: float = 0.0
    width: int = 0
    height: int = 0
    losses: int = 0


class Camera:
    """Reads `source` (see `telepresence_1.camera_sources.open_source`) on a thread of its own from `start` to `close`.

    Args:
        wanted: Whether to open the source from the start, see `film`.
        width, height: What a camera is asked for; larger pictures are scaled to fit [pixel].
        rate: What a camera is asked for, and the speed of a test card [pictures/s].
        quality: Of the JPEG that is made here, 1 to 100. OpenCV's own default of 95 more than doubles the bytes of 80.
        on_change: Called on the camera's thread with each new status whose state differs.
    Raises:
        ValueError: A number out of its range.
    """

    def __init__(
        self,
        source: str,
        *,
        width: int = 640,
        height: int = 480,
        rate: float = 30.0,
        quality: int = 80,
        wanted: bool = True,
        on_change: Callable[[CameraStatus], None] | None = None,
    ) -> None:
        if not (16 <= width <= 8192 and 16 <= height <= 8192 and 0.1 <= rate <= 240 and 1 <= quality <= 100):
            raise ValueError(f"a camera of {width}x{height} at {rate} pictures/s, quality {quality}, is out of range")
        self.image = LatestImage()
        self.wanted = wanted
        """Whether the source may be open."""
        self._status = _first_status(source, wanted)
        self._size = (width, height)
        self._rate = rate
        self._quality = quality
        self._elsewhere_until = 0.0
        self._elsewhere = CameraStatus(State.OPENING, "", "elsewhere")
        self._on_change = on_change or (lambda _status: None)
        self._losses = 0
        self._putting = threading.RLock()  # around what is shown, and what says whether it may be
        self._news = threading.Event()  # set by `film` and `close`
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)

    def start(self) -> Camera:
        self._thread.start()
        return self

    def close(self) -> None:
        """Release the source. A read from the network may outlast the wait; its thread ends once the read returns."""
        self._stop.set()
        self._news.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=0.8)

    def film(self, wanted: bool) -> None:
        """Open the source, or close it: once this has returned, no picture of it follows. From any thread."""
        with self._putting:
            if wanted == self.wanted:
                return
            self.wanted = wanted
            self._status = _first_status(self._status.source, wanted)
            if not wanted:
                self._put_notice(OFF, OFF_TEXT, wanted=False)
        self._news.set()

    @property
    def status(self) -> CameraStatus:
        """What the pictures show and why, now."""
        return self._elsewhere if self.shows_elsewhere else self._status

    def show(self, data: bytes, stamp: float) -> None:
        """Show a picture from elsewhere, from any one thread, for at most `ELSEWHERE_LIFE`.

        Args:
            data: A JPEG file; empty where the camera there is covered for the moment.
            stamp: When it was taken [s since 1970].
        Raises:
            ValueError: It is no picture that is shown.
        """
        whole = completed(data) if data else None
        if data and (whole is None or len(data) > LARGEST_PASSED):
            raise ValueError(f"{len(data)} bytes are no picture of at most {LARGEST_PASSED}")
        if whole is None:
            status = CameraStatus(State.LOST, "The camera is covered.", "elsewhere")
            picture = self._encode(draw_notice(*self._size, "Camera paused", status.text, stamp))
        else:
            status = CameraStatus(State.LIVE, "Live", "elsewhere", 0.0, whole.width, whole.height)
            picture = whole.data
        with self._putting:
            self._elsewhere, self._elsewhere_until = status, time.monotonic() + ELSEWHERE_LIFE
            self.image.put(picture, stamp)

    @property
    def shows_elsewhere(self) -> bool:
        """Whether pictures come from elsewhere."""
        return time.monotonic() < self._elsewhere_until

    def __enter__(self) -> Camera:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        pause = FIRST_PAUSE
        if self.wanted:
            self._put_notice("One moment", self._status.text, missing=False)
        while not self._stop.is_set():
            self._news.clear()
            if not self.wanted:
                pause = FIRST_PAUSE
                self._show_notice(OFF, OFF_TEXT, NOTICE_PERIOD, wanted=False)
                continue
            try:
                self._read_until_lost()
            except SourceError as error:
                title, text = error.title, str(error)
            except Exception:  # the page must go on, with a notice, whatever a camera's driver raises
                log.exception("the camera thread failed")
                title, text = "Camera failed", "The program's log says why."
            else:
                continue  # closed, or not wanted any more
            if self._status.state is State.LIVE:
                pause = FIRST_PAUSE
                self._losses += 1
            self._change(State.LOST, text)
            self._show_notice(title, text, pause)
            pause = min(2 * pause, LONGEST_PAUSE)

    def _read_until_lost(self) -> None:
        """Returns when the camera is closed, or not wanted. Raises SourceError."""
        source = open_source(self._status.source, *self._size, self._rate)
        try:
            self._publish(source)
        finally:
            source.close()

    def _publish(self, source: Source) -> None:
        count, since = 0, time.monotonic()
        while not self._stop.is_set() and self.wanted:
            picture = source.read()
            stamp = time.time()
            width, height = self._publish_one(picture, stamp)
            if self._status.state is not State.LIVE:
                self._change(State.LIVE, "Live", 0.0, width, height)
            count += 1
            elapsed = time.monotonic() - since
            if elapsed >= 1.0:
                self._change(State.LIVE, "Live", count / elapsed, width, height)
                count, since = 0, time.monotonic()

    def _publish_one(self, picture: np.ndarray | Jpeg, stamp: float) -> tuple[int, int]:
        """Returns the size of what was published [pixel]."""
        if isinstance(picture, Jpeg):
            fits = picture.width <= self._size[0] and picture.height <= self._size[1]
            if fits and len(picture.data) <= LARGEST_PASSED:
                self._put(picture.data, stamp)
                return picture.width, picture.height
            try:
                pixels = decode_jpeg(picture.data)
            except ValueError as error:
                raise SourceError("Bad picture", f"The camera sends {error}.") from error
        else:
            pixels = picture
        pixels = _fit(pixels, *self._size)
        self._put(pixels, stamp)
        return pixels.shape[1], pixels.shape[0]

    def _show_notice(self, title: str, text: str, duration: float, wanted: bool = True) -> None:
        """Returns early when the camera is closed, or wanted or not wanted from now on."""
        end = time.monotonic() + duration
        while True:
            self._put_notice(title, text, wanted=wanted)
            left = end - time.monotonic()
            if left <= 0 or self._news.wait(min(left, NOTICE_PERIOD)):
                return

    def _put_notice(self, title: str, text: str, missing: bool = True, wanted: bool = True) -> None:
        now = time.time()
        self._put(draw_notice(*self._size, title, text, now, missing), now, wanted)

    def _put(self, picture: np.ndarray | bytes, stamp: float, wanted: bool = True) -> None:
        """Show what is meant for a camera that is `wanted`, or for one that is not; nothing while pictures come from
        elsewhere."""
        if wanted is not self.wanted or self.shows_elsewhere:
            return
        data = picture if isinstance(picture, bytes) else self._encode(picture)
        with self._putting:
            if wanted is self.wanted and not self.shows_elsewhere:
                self.image.put(data, stamp)

    def _encode(self, picture: np.ndarray) -> bytes:
        try:
            return encode_jpeg(picture, self._quality, "bgr")
        except ValueError as error:
            raise SourceError("Bad picture", f"{error}.") from error

    def _change(self, state: State, text: str, rate: float = 0.0, width: int = 0, height: int = 0) -> None:
        with self._putting:
            before = self._status
            if not self.wanted:
                return
            self._status = CameraStatus(state, text, before.source, rate, width, height, self._losses)
        if state is before.state and text == before.text:
            return
        if state is State.LIVE:
            log.info("camera %s is live, %dx%d", before.source, width, height)
        else:
            log.warning("camera %s: %s", before.source, text)
        if state is not before.state:
            self._on_change(self._status)


def _first_status(source: str, wanted: bool) -> CameraStatus:
    if wanted:
        return CameraStatus(State.OPENING, f"Opening {source}", source)
    return CameraStatus(State.LOST, OFF, source)


def _fit(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """Scaled down to fit, never up."""
    scale = min(width / picture.shape[1], height / picture.shape[0])
    if scale >= 1.0:
        return picture
    size = (max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale)))
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
