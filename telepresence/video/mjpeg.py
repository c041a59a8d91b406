"""Streams the newest JPEG of a `LatestImage` to any number of viewers over HTTP, by gevent without monkey patching.

A picture is encoded once and handed to every viewer. Nobody queues: a viewer that is slow skips pictures, and the small
send buffer of `telepresence.web.server.listener` keeps the ones already under way few, hence young.

Two layouts of multipart/x-mixed-replace:

    plain    --B, Content-Type, Content-Length, X-Timestamp, JPEG, --B, ...
    advance  --B, Content-Type, JPEG, --B, Content-Type, (the next JPEG later) ...

Programs read the plain layout's part to its end at once. Browsers paint a part when the headers of the next one are
there (Chromium to this day: its issue 527446; ustreamer has an option `advance_headers` for it): for them the plain
layout is one picture late.
"""

from __future__ import annotations

import threading
import time
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gevent
import gevent.event

from telepresence.video.images import LatestImage, Picture

BOUNDARY = b"frame"
"""Boundary that the report uses: clients that split the stream at --frame find it."""
CONTENT_TYPE = "multipart/x-mixed-replace; boundary=" + BOUNDARY.decode()
_DELIMITER = b"\r\n--" + BOUNDARY + b"\r\n"
_NEXT_PART = _DELIMITER + b"Content-Type: image/jpeg\r\n\r\n"

NO_PICTURE_TIMEOUT = 10.0
"""Seconds after which a response without a first picture is ended; the viewer asks again."""


class TooManyViewers(RuntimeError):
    """The limit of viewers, of all or of one address, is reached."""


class MjpegStream:
    """Multipart responses and long polls for one source of JPEG pictures.

    All methods but the properties belong to the thread whose gevent hub answers the requests; the pictures may come
    from any thread. While nobody watches, a new picture costs nothing here.

    Args:
        image: Holds complete JPEG files as `bytes`.
        max_viewers: Streams open at the same time.
        max_viewers_per_address: Of these, for one client address.
        resend_period: A picture that has no successor is sent again after this time [s]: it shows who is gone, and
            browsers that paint late get to paint it.
    """

    def __init__(
        self,
        image: LatestImage,
        *,
        max_viewers: int = 64,
        max_viewers_per_address: int = 64,
        resend_period: float = 1.0,
    ) -> None:
        self.image = image
        self.resend_period = resend_period
        self._max_viewers = max_viewers
        self._max_per_address = max_viewers_per_address
        # Weak: a response that fails before it reaches the server is never closed.
        self._viewings: weakref.WeakSet[Viewing] = weakref.WeakSet()
        self._parts: dict[bool, tuple[int, bytes]] = {}
        self._waiting = 0
        self._changed = gevent.event.Event()
        self._lock = threading.Lock()  # protects _watcher against a writer's thread
        self._watcher: Any = None

    @property
    def viewers(self) -> int:
        """Streams that are open now."""
        return len(self._viewings)

    def stalled(self, viewer: str) -> float | None:
        """Return the seconds since the stream with this name last took a picture; None when there is no such stream.

        At most `resend_period` for a viewer that keeps up. A page uses it to find out that its own stream is dead."""
        now = time.monotonic()
        ages = [now - viewing.progress for viewing in self._viewings if viewing.name == viewer]
        return min(ages, default=None)

    def view(self, *, advance: bool = False, address: str = "", name: str = "") -> Viewing:
        """Return the body of one endless response of type `CONTENT_TYPE`; `close()` it at the end, as WSGI demands.

        Args:
            advance: Layout for browsers (see above).
            address: The client's, for the limit per address.
            name: Chosen by the client, for `stalled`.
        Raises:
            TooManyViewers: Answer 503.
        """
        if len(self._viewings) >= self._max_viewers:
            raise TooManyViewers(f"{self._max_viewers} viewers are watching already, which is the limit")
        if sum(viewing.address == address for viewing in self._viewings) >= self._max_per_address:
            raise TooManyViewers(f"{address} has {self._max_per_address} streams open already, which is the limit")
        viewing = Viewing(self, advance, address, name)
        self._viewings.add(viewing)
        return viewing

    def newer(self, sequence: int, timeout: float) -> Picture | None:
        """Wait up to `timeout` seconds for a picture other than number `sequence`; None when none came."""
        deadline = time.monotonic() + timeout
        with self._attached():
            while True:
                changed = self._changed  # read before `peek`, so that no put falls between the two
                picture = self.image.peek()
                if picture is not None and picture.sequence != sequence:
                    return picture
                left = deadline - time.monotonic()
                if left <= 0 or not changed.wait(left):
                    return None

    def part(self, picture: Picture, advance: bool) -> bytes:
        """Return one part as it is sent, built once for all viewers."""
        sequence, part = self._parts.get(advance, (0, b""))
        if sequence != picture.sequence:
            if advance:
                part = picture.content + _NEXT_PART
            else:
                head = b"Content-Type: image/jpeg\r\nContent-Length: %d\r\nX-Timestamp: %.6f\r\n\r\n"
                part = head % (len(picture.content), picture.stamp) + picture.content + _DELIMITER
            self._parts[advance] = picture.sequence, part
        return part

    def forget(self, viewing: Viewing) -> None:
        """Remove a viewing that is closed."""
        self._viewings.discard(viewing)

    @contextmanager
    def _attached(self) -> Iterator[None]:
        """Listen to the pictures while at least one greenlet waits for them."""
        if self._waiting == 0:
            watcher = gevent.get_hub().loop.async_()
            watcher.start(self._wake)
            self._watcher = watcher
            self.image.add_listener(self._notify)
        self._waiting += 1
        try:
            yield
        finally:
            self._waiting -= 1
            if self._waiting == 0:
                self.image.remove_listener(self._notify)
                with self._lock:
                    watcher, self._watcher = self._watcher, None
                watcher.stop()
                watcher.close()

    def _notify(self) -> None:  # on the writer's thread
        with self._lock:
            if self._watcher is not None:
                self._watcher.send()

    def _wake(self) -> None:  # in the hub
        changed, self._changed = self._changed, gevent.event.Event()
        changed.set()


class Viewing:
    """The body of one viewer's response: an iterator that waits for the newest picture."""

    def __init__(self, stream: MjpegStream, advance: bool, address: str, name: str) -> None:
        self.address = address
        self.name = name
        self.progress = time.monotonic()
        self._stream = stream
        self._advance = advance
        self._greeted = False
        self._sequence = 0

    def __iter__(self) -> Viewing:
        return self

    def __next__(self) -> bytes:
        self.progress = time.monotonic()  # the server asks for more once the socket has taken the part before
        if not self._greeted:  # the response's headers leave with it, before there is a picture
            self._greeted = True
            return (_NEXT_PART if self._advance else _DELIMITER).lstrip()
        stream = self._stream
        timeout = stream.resend_period if self._sequence else NO_PICTURE_TIMEOUT
        picture = stream.newer(self._sequence, timeout) or stream.image.peek()
        if picture is None:
            raise StopIteration
        self._sequence = picture.sequence
        return stream.part(picture, self._advance)

    def close(self) -> None:
        self._stream.forget(self)
