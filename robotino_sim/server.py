"""Robotino's web server: REST over plain HTTP, no authentication, as on RobotinoOS 4.

    GET, HEAD   /data/NAME      JSON          readings.py
    PUT, POST   /data/NAME      JSON body     commands.py; 200 with an empty body, 400 with a reason
    GET, HEAD   /cam0           image/jpeg    500 "No camera connected" without a picture
    GET, HEAD   /sensorimage    image/png
    OPTIONS     anything        Allow: DELETE, GET, POST, PUT

Queries (?sid=NAME, ?stamp=N) and content types are ignored, unknown paths are 404, connections may be kept alive.
Sources: wiki.openrobotino.org, page Rest api; alexkorga/hsbi-robotino-navigation, robotino_http_api_inventory.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import gevent

from robotino_sim import commands, readings
from robotino_sim.json_body import BadRequest, from_json, to_json
from robotino_sim.programs import Programs
from robotino_sim.robot import Robotino
from robotino_sim.sensor_image import draw_sensors
from robotino_sim.webcam import Webcam

ALLOW = "DELETE, GET, POST, PUT"
JSON, JPEG, PNG, TEXT, BINARY = (
    "application/json",
    "image/jpeg",
    "image/png",
    "text/plain; charset=utf-8",
    "application/octet-stream",
)
CAMERA_PATIENCE = 3.0
"""Seconds that a request waits for the first picture of a camera that was released."""
_SERVICE_STATUS, _DOWNLOAD = "/data/servicestatus/", "/download/program/"
_REASONS = {
    200: "200 OK",
    400: "400 Bad Request",
    404: "404 Not Found",
    405: "405 Method Not Allowed",
    413: "413 Content Too Large",
    500: "500 Internal Server Error",
}

Environ = dict[str, Any]
StartResponse = Callable[[str, list[tuple[str, str]]], Any]


@dataclass(frozen=True)
class Response:
    """An HTTP answer."""

    status: int = 200
    body: bytes = b""
    content_type: str = JSON
    headers: tuple[tuple[str, str], ...] = ()


def create_app(
    robot: Robotino, webcam: Webcam, *, strict_camera: bool = False, cors: bool = False
) -> Callable[[Environ, StartResponse], Iterable[bytes]]:
    """The WSGI application in front of `robot`, to be served by `telepresence.web.server.WebServer`.

    Args:
        strict_camera: Answer /cam0 as the web server of 2021 did: 500 unless there is a picture nobody has fetched.
        cors: Let pages of other web servers read the answers; the real robot does not.
    """
    return _Application(robot, webcam, strict_camera, cors)


class _Application:
    def __init__(self, robot: Robotino, webcam: Webcam, strict_camera: bool, cors: bool) -> None:
        programs = Programs()
        self._robot = robot
        self._webcam = webcam
        self._programs = programs
        self._readings = readings.table(programs)
        self._commands = commands.table(robot, programs)
        self._strict_camera = strict_camera
        self._extra = [("Access-Control-Allow-Origin", "*")] if cors else []
        self._fetched = 0
        self._drawing: tuple[Any, bytes] = (None, b"")

    def __call__(self, environ: Environ, start_response: StartResponse) -> Iterable[bytes]:
        method = environ["REQUEST_METHOD"]
        response = self._answer(method, environ.get("PATH_INFO", "/"), environ)
        headers = [
            ("Content-Type", response.content_type),
            ("Content-Length", str(len(response.body))),
            *response.headers,
            *self._extra,
        ]
        start_response(_REASONS[response.status], headers)
        return [] if method == "HEAD" else [response.body]

    def _answer(self, method: str, path: str, environ: Environ) -> Response:
        if method == "OPTIONS":
            preflight = [("Access-Control-Allow-Methods", ALLOW), ("Access-Control-Allow-Headers", "Content-Type")]
            return Response(headers=(("Allow", ALLOW), *(preflight if self._extra else ())))
        if method in ("GET", "HEAD"):
            return self._read(path)
        if method in ("PUT", "POST"):
            return self._write(path, environ)
        return _refusal(405, f"{method} does nothing on this robot")

    # --- GET ---------------------------------------------------------------------------------------------------------

    def _read(self, path: str) -> Response:
        if path in self._readings:
            value = self._readings[path](self._robot)
            return Response() if value is readings.EMPTY else Response(body=to_json(value))
        if path == "/cam0":
            return self._camera()
        if path == "/sensorimage":
            return Response(body=self._sensor_image(), content_type=PNG)
        if path.startswith(_SERVICE_STATUS):
            records = readings.service_status(path.removeprefix(_SERVICE_STATUS))
            return Response(body=to_json(records)) if records else _unknown(path)
        if path.startswith(_DOWNLOAD):
            program = self._programs.read(path.removeprefix(_DOWNLOAD))
            return Response(body=program, content_type=BINARY) if program is not None else _unknown(path)
        if path in self._commands:
            return _refusal(405, f"{path} can be written, not read")
        return _unknown(path)

    def _camera(self) -> Response:
        was_awake = self._webcam.awake
        self._webcam.wake()
        picture = self._webcam.jpeg()
        if self._strict_camera:
            if not was_awake or picture is None or picture[1] == self._fetched:
                return _refusal(500, "No camera connected")
        else:
            deadline = time.monotonic() + CAMERA_PATIENCE
            while picture is None and time.monotonic() < deadline:
                gevent.sleep(0.01)
                picture = self._webcam.jpeg()
            if picture is None:
                return _refusal(500, "No camera connected")
        self._fetched = picture[1]
        return Response(body=picture[0], content_type=JPEG)

    def _sensor_image(self) -> bytes:
        snapshot = self._robot.snapshot()
        shown = (snapshot.distances, snapshot.bumper)
        if self._drawing[0] != shown:
            self._drawing = shown, draw_sensors(*shown)
        return self._drawing[1]

    # --- PUT and POST ------------------------------------------------------------------------------------------------

    def _write(self, path: str, environ: Environ) -> Response:
        command = self._commands.get(path)
        if command is None:
            if path in self._readings or path in ("/cam0", "/sensorimage"):
                return _refusal(405, f"{path} can be read, not written")
            return _unknown(path)
        length = int(environ.get("CONTENT_LENGTH") or 0)  # the server has refused anything but digits
        body = environ["wsgi.input"].read(command.limit + 1) if length <= command.limit else None
        if body is None or len(body) > command.limit:
            return _refusal(413, f"{path} takes at most {command.limit} bytes", (("Connection", "close"),))
        if len(body) < length:
            return _refusal(400, f"{length} bytes were announced, {len(body)} arrived", (("Connection", "close"),))
        try:
            command.run(from_json(body))
        except BadRequest as error:
            return _refusal(400, str(error))
        return Response()


def _unknown(path: str) -> Response:
    return _refusal(404, f"there is no {path}")


def _refusal(status: int, reason: str, headers: tuple[tuple[str, str], ...] = ()) -> Response:
    if status == 405:
        headers = (*headers, ("Allow", ALLOW))
    return Response(status, reason.encode() + b"\n", TEXT, headers)
