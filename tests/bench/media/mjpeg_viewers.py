"""Viewers of an MJPEG stream, many in one thread, quick, throttled or stalled; they count pictures and ages."""

from __future__ import annotations

import re
import selectors
import socket
import time

_HEAD = re.compile(rb"Content-Length: (\d+)\r\nX-Timestamp: ([\d.]+)\r\n")
_CHUNK = 1 << 18
_TAIL = 256
"""A part's head may be cut in two by the socket; so many bytes of the last read are looked at again."""


class Viewer:
    """One connection.

    Args:
        speed: Bytes read per second; None for as fast as they come, 0 for none after the request.
    Attributes:
        pictures: Heads of pictures that have arrived.
        ages: Of the pictures when their head was read [s].
    """

    def __init__(self, port: int, speed: float | None = None) -> None:
        self.speed = speed
        self.pictures = 0
        self.ages: list[float] = []
        self._tail = b""
        self._allowance, self._since = 0.0, time.monotonic()
        self.socket = socket.socket()
        if speed is not None:
            # A weak radio link, not a fast one into a large buffer.
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32768)
        self.socket.connect(("127.0.0.1", port))
        self.socket.sendall(b"GET /video_feed HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        self.socket.setblocking(False)

    def read(self) -> None:
        size = _CHUNK
        if self.speed is not None:
            now = time.monotonic()
            self._allowance = min(self._allowance + (now - self._since) * self.speed, 65536.0)
            self._since = now
            size = int(self._allowance)
        if size <= 0:
            return
        try:
            data = self.socket.recv(size)
        except BlockingIOError:
            return
        if not data:
            raise RuntimeError("the server has closed a stream")
        if self.speed is not None:
            self._allowance -= len(data)
        now = time.time()
        window = self._tail + data
        end = 0
        for head in _HEAD.finditer(window):
            self.pictures += 1
            self.ages.append(now - float(head[2]))
            end = head.end()
        self._tail = window[max(end, len(window) - _TAIL) :]


class Audience:
    """Viewers that watch together; use it as a context."""

    def __init__(self, port: int, quick: int = 0, throttled: tuple[float, ...] = (), stalled: int = 0) -> None:
        self.quick = [Viewer(port) for _ in range(quick)]
        self.throttled = [Viewer(port, speed) for speed in throttled]
        self.stalled = [Viewer(port, 0.0) for _ in range(stalled)]
        self._selector = selectors.DefaultSelector()
        for viewer in self.quick:
            self._selector.register(viewer.socket, selectors.EVENT_READ, viewer)

    def watch(self, seconds: float) -> None:
        """Read for a while; counts start anew."""
        for viewer in self.quick + self.throttled:
            viewer.pictures, viewer.ages = 0, []
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            for key, _ in self._selector.select(min(left, 0.005 if self.throttled else 0.05)):
                key.data.read()
            for viewer in self.throttled:
                viewer.read()

    def __enter__(self) -> Audience:
        return self

    def __exit__(self, *_: object) -> None:
        self._selector.close()
        for viewer in self.quick + self.throttled + self.stalled:
            viewer.socket.close()
