"""The walker's web server and its program, over HTTP, in real time."""

from __future__ import annotations

import json
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator

import cv2
import numpy as np
import pytest

from telepresence.sim.walker.simulation import Simulation
from telepresence.teleop.movement import Movement


@pytest.fixture(scope="module")
def simulation() -> Iterator[Simulation]:
    with Simulation(port=0) as running:
        yield running


@pytest.fixture
def request_(simulation: Simulation) -> Callable[..., tuple[int, bytes]]:
    """Ask the server; status and body. The world starts afresh for every test."""
    simulation.restart()

    def ask(method: str, path: str, body: bytes | None = None) -> tuple[int, bytes]:
        asked = urllib.request.Request(simulation.url + path, body, method=method)
        try:
            with urllib.request.urlopen(asked, timeout=10.0) as answer:
                return answer.status, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.read()

    return ask


def test_a_velocity_moves_it_and_silence_freezes_it(request_: Callable, wait_until: Callable):
    def state() -> dict:
        return json.loads(request_("GET", "/state")[1])

    def moved() -> bool:
        assert request_("PUT", "/velocity", b"[0.25, 0, 0]") == (200, b"")
        return state()["odometry"][0] > 0.1

    assert state()["feet"] == [True] * 4 or wait_until(lambda: state()["feet"] == [True] * 4, "it stands")
    wait_until(moved, "the walker has walked 10 cm")
    assert state()["walking"] and state()["gait"] == "trot"
    wait_until(lambda: not state()["walking"], "the watchdog freezes the gait")


def test_the_gait_can_be_chosen(request_: Callable):
    assert request_("PUT", "/gait", b'"crawl"') == (200, b"")
    assert json.loads(request_("GET", "/state")[1])["gait"] == "crawl"
    assert request_("POST", "/gait", b'"trot"') == (200, b"")


def test_the_camera_gives_a_jpeg(request_: Callable):
    status, body = request_("GET", "/camera")
    picture = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR)
    assert status == 200 and picture.shape == (480, 640, 3) and picture.std() > 10.0


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "says"),
    [
        ("PUT", "/velocity", b"[1, 2]", 400, "got [1, 2]"),
        ("PUT", "/velocity", b"[NaN, 0, 0]", 400, "not a finite number"),
        ("PUT", "/velocity", b"[1e999, 0, 0]", 400, "not a finite number"),
        ("PUT", "/velocity", b"[1" + b"0" * 400 + b", 0, 0]", 400, "not a finite number"),
        ("PUT", "/velocity", b"[true, 0, 0]", 400, "True is not a finite number"),
        ("PUT", "/velocity", b"", 400, "not JSON"),
        ("PUT", "/velocity", b"[" * 1000, 400, "not JSON"),
        ("PUT", "/velocity", b"[" + b" " * 2000, 413, "1024 bytes"),
        ("PUT", "/gait", b'"gallop"', 400, "gaits: trot, crawl"),
        ("PUT", "/gait", b"3", 400, "name of a gait"),
        ("GET", "/velocity", None, 405, "written only"),
        ("PUT", "/state", b"1", 405, "read only"),
        ("DELETE", "/state", None, 405, "read only"),
        ("GET", "/other", None, 404, "/state, /camera, /velocity, /gait"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_reason(
    request_: Callable, method: str, path: str, body: bytes | None, status: int, says: str
):
    answered, text = request_(method, path, body)
    assert answered == status and says in text.decode()
    assert not json.loads(request_("GET", "/state")[1])["walking"]


def test_movement_commands_reach_it_beside_the_wire(simulation: Simulation, wait_until: Callable):
    simulation.restart()
    controls = simulation.robots["walker"].controls
    controls.move(Movement.BACKWARD)
    wait_until(lambda: simulation.robot.snapshot().odometry[0] < -0.1, "it walks backward")
    controls.move(Movement.STOP)
    wait_until(lambda: not simulation.robot.snapshot().walking, "it freezes")
    with controls.subscribe_camera(640, 480, 10.0) as feed:
        assert feed.image.wait_newer(0, timeout=20.0).content.shape == (480, 640, 3)


def test_the_program_announces_its_address_and_ends_on_sigterm(run_program: Callable):
    program = run_program(
        *(sys.executable, "-m", "telepresence.sim.walker", "--port", "0", "--terrain", "rough", "--gait", "crawl"),
        stdout=subprocess.PIPE,
        text=True,
    )
    line = program.stdout.readline()
    assert line.startswith("listening on http://127.0.0.1:")
    with urllib.request.urlopen(line.split()[-1] + "/state", timeout=10.0) as answer:
        assert json.loads(answer.read())["gait"] == "crawl"
    program.terminate()
    assert program.wait(timeout=20.0) == 0


def test_the_program_names_the_terrains_there_are(run_program: Callable):
    program = run_program(
        *(sys.executable, "-m", "telepresence.sim.walker", "--port", "0", "--terrain", "moon"),
        stderr=subprocess.PIPE,
        text=True,
    )
    _, errors = program.communicate(timeout=30.0)
    assert program.returncode == 1 and "flat" in errors and "Traceback" not in errors
