"""The walker's web server: JSON over plain HTTP, without a password; meant for loopback.

    GET   /state      JSON object, see below
    GET   /camera     image/jpeg, 640x480, the newest picture; 503 while there is none yet
    PUT   /velocity   [vx, vy, wz] in m/s, m/s, rad/s: walk for 0.5 s, or until the next one; zeros freeze the gait
    PUT   /gait       "trot" or "crawl", from the next start on

POST does what PUT does. A body that is not what a path takes is answered with 400 and a reason and has no effect. The
members of /state are those of `robot.Snapshot`: time and stamp [s], odometry [x, y, theta], velocity [vx, vy, wz],
attitude [roll, pitch, yaw], joints and torques (12 numbers, leg by leg), feet (4 times true or false), gait, phase,
walking, fallen; SI units.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import gevent

from telepresence.sim.camera import CamerasFailed, Feed
from telepresence.sim.walker.robot import Walker
from telepresence.video.jpeg import encode_jpeg
from telepresence.web.json_app import (
    JPEG,
    Application,
    BadRequest,
    Environ,
    Refusal,
    Response,
    json_app,
    numbers,
    read_json,
    shown,
    wait_for_picture,
)

WIDTH, HEIGHT, RATE = 640, 480, 10.0
"""Size and rate of the pictures [px, px, Hz]."""
CAMERA_TIMEOUT = 3.0
"""Seconds that a request waits for the first picture."""
CAMERA_RELEASE = 10.0
"""Seconds after the last request until drawing stops."""
MAX_BODY = 1024
"""[bytes]"""


def create_app(walker: Walker) -> Application:
    """Make the WSGI application in front of `walker`, to be served by `telepresence.web.server.WebServer`."""
    camera = _Camera(walker)

    def state() -> Response:
        return Response(body=json.dumps(asdict(walker.snapshot()), allow_nan=False).encode())

    def picture() -> Response:
        return Response(body=camera.jpeg(), content_type=JPEG)

    def velocity(body: Any) -> None:
        vx, vy, wz = numbers(body, 3, "[vx, vy, wz] in m/s, m/s and rad/s")
        walker.set_velocity(vx, vy, wz)

    def gait(body: Any) -> None:
        if not isinstance(body, str):
            raise BadRequest(f'expected the name of a gait, such as "trot", got {shown(body)}')
        try:
            walker.choose_gait(body)
        except ValueError as error:
            raise BadRequest(str(error)) from None

    reads: dict[str, Callable[[], Response]] = {"/state": state, "/camera": picture}
    writes: dict[str, Callable[[Any], None]] = {"/velocity": velocity, "/gait": gait}

    def answer(method: str, path: str, environ: Environ) -> Response:
        if method in ("GET", "HEAD") and path in reads:
            return reads[path]()
        if method in ("PUT", "POST") and path in writes:
            writes[path](read_json(environ, path, MAX_BODY))
            return Response()
        if path in reads or path in writes:
            raise Refusal(405, f"{path} can be {'read' if path in reads else 'written'} only")
        raise Refusal(404, f"there is no {path}; there are {', '.join((*reads, *writes))}")

    return json_app(answer)


class _Camera:
    """Has pictures drawn while clients request them. Its methods belong to the server's thread."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker
        self._feed: Feed | None = None
        self._last_request = 0.0
        self._encoded: tuple[int, bytes] = (0, b"")

    def jpeg(self) -> bytes:
        self._last_request = time.monotonic()
        if self._feed is None:
            try:
                self._feed = self._walker.subscribe_camera(WIDTH, HEIGHT, RATE)
            except (CamerasFailed, RuntimeError) as error:
                raise Refusal(503, f"the camera has no picture: {error}") from error
            gevent.spawn_later(CAMERA_RELEASE, self._release)
        picture = wait_for_picture(self._feed.image.peek, CAMERA_TIMEOUT)
        if picture is None:
            raise Refusal(503, "the camera has no picture yet")
        if self._encoded[0] != picture.sequence:
            self._encoded = (picture.sequence, encode_jpeg(picture.content))
        return self._encoded[1]

    def _release(self) -> None:
        left = self._last_request + CAMERA_RELEASE - time.monotonic()
        if left > 0.0:
            gevent.spawn_later(left, self._release)
        elif self._feed is not None:
            self._feed.close()
            self._feed, self._encoded = None, (0, b"")
