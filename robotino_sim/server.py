"""Robotino's web server: REST over plain HTTP, no authentication, as on RobotinoOS 4. Unlike there, pages of other web
servers cannot drive it from somebody's browser, unless it is told to let them (`--cors`).

    GET, HEAD   /               text/html     start_page.py
    GET, HEAD   /data/NAME      JSON          readings.py
    PUT, POST   /data/NAME      JSON body     commands.py; 200 with an empty body, 400 with a reason
    GET, HEAD   /cam0           image/jpeg    500 "No camera connected" without a picture
    GET, HEAD   /sensorimage    image/png
    OPTIONS     anything        Allow: DELETE, GET, POST, PUT

Queries (?sid=NAME, ?stamp=N) and content types are ignored, unknown paths are 404, connections may be kept alive.
Sources: wiki.openrobotino.org, page Rest api; alexkorga/hsbi-robotino-navigation, robotino_http_api_inventory.md.
"""

from __future__ import annotations

from typing import Any

from robotino_sim import commands, readings
from robotino_sim.json_body import to_json
from robotino_sim.programs import Programs
from robotino_sim.robot import Robotino
from robotino_sim.sensor_image import draw_sensors
from robotino_sim.start_page import start_page
from robotino_sim.webcam import Webcam
from telepresence.web.json_app import (
    BINARY,
    HTML,
    JPEG,
    PNG,
    Application,
    Environ,
    Refusal,
    Response,
    json_app,
    read_json,
    wait_for_picture,
)

ALLOW = "DELETE, GET, POST, PUT"
CAMERA_TIMEOUT = 3.0
"""Seconds that a request waits for the first picture of a camera that was released."""
_SERVICE_STATUS, _DOWNLOAD = "/data/servicestatus/", "/download/program/"


def create_app(robot: Robotino, webcam: Webcam, *, strict_camera: bool = False, cors: bool = False) -> Application:
    """Make the WSGI application in front of `robot`, to be served by `telepresence.web.server.WebServer`.

    Args:
        strict_camera: Answer /cam0 as the web server of 2021 did: 500 unless there is a picture nobody has fetched.
        cors: Let pages of other web servers read the answers and send commands. The real robot takes commands from any
            page, and lets none read.
    """
    extra = (("Access-Control-Allow-Origin", "*"),) if cors else ()
    return json_app(_Routes(robot, webcam, strict_camera, cors).answer, extra, any_page=cors)


class _Routes:
    """What each method and path is answered with."""

    def __init__(self, robot: Robotino, webcam: Webcam, strict_camera: bool, cors: bool) -> None:
        programs = Programs()
        self._robot = robot
        self._webcam = webcam
        self._programs = programs
        self._readings = readings.table(programs)
        self._commands = commands.table(robot, programs)
        self._strict_camera = strict_camera
        self._cors = cors
        self._fetched = 0
        self._drawing: tuple[Any, bytes] = (None, b"")

    def answer(self, method: str, path: str, environ: Environ) -> Response:
        if method == "OPTIONS":
            preflight = [("Access-Control-Allow-Methods", ALLOW), ("Access-Control-Allow-Headers", "Content-Type")]
            return Response(headers=(("Allow", ALLOW), *(preflight if self._cors else ())))
        if method in ("GET", "HEAD"):
            return self._read(path)
        if method in ("PUT", "POST"):
            return self._write(path, environ)
        raise _not_allowed(f"{method} does nothing on this robot")

    # --- GET ---------------------------------------------------------------------------------------------------------

    def _read(self, path: str) -> Response:
        if path in self._readings:
            value = self._readings[path](self._robot)
            return Response() if value is readings.EMPTY else Response(body=to_json(value))
        if path == "/":
            return Response(body=start_page(self._readings), content_type=HTML)
        if path == "/cam0":
            return self._camera()
        if path == "/sensorimage":
            return Response(body=self._sensor_image(), content_type=PNG)
        if path.startswith(_SERVICE_STATUS):
            records = readings.service_status(path.removeprefix(_SERVICE_STATUS))
            if records:
                return Response(body=to_json(records))
        if path.startswith(_DOWNLOAD):
            program = self._programs.read(path.removeprefix(_DOWNLOAD))
            if program is not None:
                return Response(body=program, content_type=BINARY)
        if path in self._commands:
            raise _not_allowed(f"{path} can be written, not read")
        raise _unknown(path)

    def _camera(self) -> Response:
        was_awake = self._webcam.awake
        self._webcam.wake()
        if self._strict_camera:
            picture = self._webcam.jpeg()
            if not was_awake or (picture is not None and picture[1] == self._fetched):
                picture = None
        else:
            picture = wait_for_picture(self._webcam.jpeg, CAMERA_TIMEOUT)
        if picture is None:
            raise Refusal(500, "No camera connected")
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
            if path in self._readings or path in ("/", "/cam0", "/sensorimage"):
                raise _not_allowed(f"{path} can be read, not written")
            raise _unknown(path)
        command.run(read_json(environ, path, command.limit))
        return Response()


def _unknown(path: str) -> Refusal:
    return Refusal(404, f"there is no {path}")


def _not_allowed(reason: str) -> Refusal:
    return Refusal(405, reason, (("Allow", ALLOW),))
