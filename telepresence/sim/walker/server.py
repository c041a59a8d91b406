"""The walker's web server: JSON over plain HTTP, without a password; meant for loopback.

    GET   /state      JSON object, see below
    GET   /camera     image/jpeg, 640x480, the newest picture; 503 while there is none yet
    PUT   /velocity   [vx, vy, wz] in m/s, m/s, rad/s: walk so for 0.5 s, or until the next one; zeros freeze the gait
    PUT   /gait       "trot" or "crawl", from the next start on

POST does what PUT does. A body that is not what a path takes is answered with 400 and a reason and has no effect. The
members of /state are those of `robot.Snapshot`: time and stamp [s], odometry [x, y, theta], velocity [vx, vy, wz],
attitude [roll, pitch, yaw], joints and torques (12 numbers, leg by leg), feet (4 times true or false), gait, phase,
walking, fallen; SI units.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict
from typing import Any

import cv2
import gevent

from telepresence.sim.camera import CamerasFailed, Feed
from telepresence.sim.walker.robot import Walker

WIDTH, HEIGHT, RATE = 640, 480, 10.0
"""Of the pictures [px, px, Hz]."""
CAMERA_PATIENCE = 3.0
"""Seconds that a request waits for the first picture."""
CAMERA_RELEASE = 10.0
"""Seconds after the last request until drawing stops."""
MAX_BODY = 1024
"""[bytes]"""
_JPEG_QUALITY = 80
_REASONS = {
    200: "200 OK",
    400: "400 Bad Request",
    404: "404 Not Found",
    405: "405 Method Not Allowed",
    413: "413 Content Too Large",
    503: "503 Service Unavailable",
}

Environ = dict[str, Any]
StartResponse = Callable[[str, list[tuple[str, str]]], Any]


class Refused(Exception):
    """An answer other than 200: the status, and a sentence for whoever asked."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason)
        self.status = status


def create_app(walker: Walker) -> Callable[[Environ, StartResponse], Iterable[bytes]]:
    """The WSGI application in front of `walker`, to be served by `telepresence.web.server.WebServer`."""
    camera = _Camera(walker)

    def state(_body: bytes) -> tuple[str, bytes]:
        return "application/json", json.dumps(asdict(walker.snapshot()), allow_nan=False).encode()

    def picture(_body: bytes) -> tuple[str, bytes]:
        return "image/jpeg", camera.jpeg()

    def velocity(body: bytes) -> tuple[str, bytes]:
        walker.set_velocity(*_three_numbers(_parse(body)))
        return "application/json", b""

    def gait(body: bytes) -> tuple[str, bytes]:
        name = _parse(body)
        if not isinstance(name, str):
            raise Refused(400, f'expected the name of a gait, such as "trot", got {_shown(name)}')
        walker.choose_gait(name)
        return "application/json", b""

    reads = {"/state": state, "/camera": picture}
    writes = {"/velocity": velocity, "/gait": gait}
    methods = {"GET": reads, "HEAD": reads, "PUT": writes, "POST": writes}

    def answer(environ: Environ) -> tuple[str, bytes]:
        path, table = environ.get("PATH_INFO", "/"), methods.get(environ["REQUEST_METHOD"], {})
        if path in table:
            return table[path](_body(environ) if table is writes else b"")
        if path in reads or path in writes:
            raise Refused(405, f"{path} can be {'read' if path in reads else 'written'} only")
        raise Refused(404, f"there is no {path}; there are {', '.join((*reads, *writes))}")

    def app(environ: Environ, start_response: StartResponse) -> Iterable[bytes]:
        status = 200
        try:
            kind, body = answer(environ)
        except (Refused, ValueError) as error:
            status = error.status if isinstance(error, Refused) else 400
            kind, body = "text/plain; charset=utf-8", f"{error}\n".encode()
        headers = [("Content-Type", kind), ("Content-Length", str(len(body)))]
        if status == 413:
            headers.append(("Connection", "close"))
        start_response(_REASONS[status], headers)
        return [] if environ["REQUEST_METHOD"] == "HEAD" else [body]

    return app


class _Camera:
    """Has pictures drawn while somebody asks for them. Its methods belong to the server's thread."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker
        self._feed: Feed | None = None
        self._asked = 0.0
        self._encoded: tuple[int, bytes] = (0, b"")

    def jpeg(self) -> bytes:
        self._asked = time.monotonic()
        if self._feed is None:
            try:
                self._feed = self._walker.subscribe_camera(WIDTH, HEIGHT, RATE)
            except (CamerasFailed, RuntimeError) as error:
                raise Refused(503, f"the camera has no picture: {error}") from error
            gevent.spawn_later(CAMERA_RELEASE, self._release)
        image = self._feed.image
        picture = image.peek()
        while picture is None and time.monotonic() - self._asked < CAMERA_PATIENCE:
            gevent.sleep(0.01)
            picture = image.peek()
        if picture is None:
            raise Refused(503, "the camera has no picture yet")
        if self._encoded[0] != picture.sequence:
            bgr = cv2.cvtColor(picture.pixels, cv2.COLOR_RGB2BGR)
            done, data = cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY))
            if not done:
                raise RuntimeError("OpenCV could not encode a picture as JPEG")
            self._encoded = (picture.sequence, data.tobytes())
        return self._encoded[1]

    def _release(self) -> None:
        left = self._asked + CAMERA_RELEASE - time.monotonic()
        if left > 0.0:
            gevent.spawn_later(left, self._release)
        elif self._feed is not None:
            self._feed.close()
            self._feed, self._encoded = None, (0, b"")


def _body(environ: Environ) -> bytes:
    length = int(environ.get("CONTENT_LENGTH") or 0)  # the server has refused anything but digits
    if length > MAX_BODY:
        raise Refused(413, f"a body has at most {MAX_BODY} bytes")
    body = environ["wsgi.input"].read(MAX_BODY + 1)
    if len(body) > MAX_BODY:
        raise Refused(413, f"a body has at most {MAX_BODY} bytes")
    return body


def _parse(body: bytes) -> Any:
    try:
        return json.loads(body.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise Refused(400, f"the body is not JSON: {error}") from None


def _three_numbers(value: Any) -> tuple[float, float, float]:
    meaning = "expected [vx, vy, wz] in m/s, m/s and rad/s"
    if not isinstance(value, list) or len(value) != 3:
        raise Refused(400, f"{meaning}, got {_shown(value)}")
    numbers = []
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not _finite(item):
            raise Refused(400, f"{meaning}: {_shown(item)} is not a finite number")
        numbers.append(float(item))
    return tuple(numbers)


def _finite(number: int | float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # a whole number too large for a float
        return False


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= 60 else shown[:57] + "..."
