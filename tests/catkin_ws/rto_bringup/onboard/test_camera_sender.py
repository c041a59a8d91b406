"""The camera sender as a program: offers, several receivers, lost cameras and lost senders."""

from __future__ import annotations

import json
import signal
import threading
import time
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from rto_bringup.onboard import picture_sources
from rto_bringup.onboard.picture_sources import CameraLost, PictureSource, open_source
from rto_node.webrtc_camera import WebrtcCamera, sender_url

pytestmark = pytest.mark.slow

SOON = 10.0
"""[s] even on a busy machine."""


def ask(port: int, method: str = "GET", path: str = "/camera", body: bytes | None = None, kind="application/sdp"):
    request = urllib.request.Request(
        f"http://127.0.0.1:{port}{path}", body, {"Content-Type": kind} if body is not None else {}, method=method
    )
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def receivers(port: int) -> int:
    return json.loads(ask(port)[1])["receivers"]


@pytest.fixture
def make_camera():
    made = []

    def make(port: int, **options) -> WebrtcCamera:
        made.append(WebrtcCamera(f"127.0.0.1:{port}", **options))
        made[-1].want(True)
        return made[-1]

    yield make
    for camera in made:
        camera.close()


@pytest.fixture(scope="module")
def sender(run_onboard):
    return run_onboard("camera", "--port", "0", "--source", "test", "--rate", "15", "--size", "320x240")


def test_pictures_come_with_their_age_and_end_when_nobody_wants_them(sender, make_camera, wait_until):
    camera = make_camera(sender.port, with_time=True)
    wait_until(lambda: camera.received > 5 and camera.age is not None, "pictures come")
    assert camera.image.peek().content.shape == (240, 320, 3)
    wait_until(lambda: 0.0 < camera.age < 1.0, "soon after they were taken")
    assert receivers(sender.port) == 1
    camera.want(False)
    wait_until(lambda: receivers(sender.port) == 0, "the receiver has left")
    camera.want(True)
    before = camera.received
    wait_until(lambda: camera.received > before, "and is back")


def test_three_receivers_see_and_a_fourth_is_told(sender, make_camera, wait_until):
    cameras = [make_camera(sender.port) for _ in range(3)]
    wait_until(lambda: all(camera.received > 2 for camera in cameras), "three see")
    fourth = make_camera(sender.port)
    wait_until(lambda: "which is the limit" in fourth.problem, "the fourth is told why not")
    cameras[0].want(False)
    wait_until(lambda: fourth.received > 2, "and sees when there is room")


@pytest.mark.parametrize("offer", [b"", b"v=0\r\n", b"\xff\xfe", b"v=0\r\nm=video x y z\r\n" * 50])
def test_nonsense_is_refused_and_leaves_nothing(sender, offer, wait_until):
    wait_until(lambda: receivers(sender.port) == 0, "nobody is there")
    status, text = ask(sender.port, "POST", body=offer)
    assert status == 400
    assert text.strip()
    assert receivers(sender.port) == 0


def test_other_requests_are_refused(sender):
    assert ask(sender.port, "POST", body=b"{}", kind="application/json")[0] == 415
    assert ask(sender.port, "POST", body=b"v=0\r\n" * 20000)[0] == 413
    assert ask(sender.port, "DELETE", "/camera/99")[0] == 404
    assert ask(sender.port, "GET", "/")[0] == 404


def test_a_killed_sender_is_noticed_and_its_successor_found(run_onboard, make_camera, wait_until):
    first = run_onboard("camera", "--port", "0", "--source", "test", "--size", "320x240")
    camera = make_camera(first.port)
    wait_until(lambda: camera.received > 5, "pictures come")
    first.process.kill()
    killed = time.monotonic()
    wait_until(lambda: camera.problem, "silence is noticed")
    assert time.monotonic() - killed < SOON, "the library alone takes half a minute"
    wait_until(lambda: "does not answer" in camera.problem, "and named")
    second = run_onboard("camera", "--port", str(first.port), "--source", "test", "--size", "320x240")
    started = time.monotonic()
    wait_until(lambda: not camera.problem, "pictures come again")
    assert time.monotonic() - started < SOON
    second.process.send_signal(signal.SIGTERM)
    wait_until(lambda: camera.problem, "a sender that ends says so")
    assert "has ended" in camera.problem or "does not answer" in camera.problem
    assert second.process.wait(20) == 0


def test_a_frozen_sender_is_left_for_a_fresh_connection(run_onboard, make_camera, wait_until):
    sender = run_onboard("camera", "--port", "0", "--source", "test", "--size", "320x240")
    camera = make_camera(sender.port, with_time=True)
    wait_until(lambda: camera.received > 5, "pictures come")
    sender.process.send_signal(signal.SIGSTOP)
    wait_until(lambda: camera.problem, "silence is noticed")
    connections = camera.connections
    sender.process.send_signal(signal.SIGCONT)
    wait_until(lambda: camera.connections > connections and not camera.problem, "a new connection")
    wait_until(lambda: camera.age < 1.0, "not what was taken before")


def test_the_robots_own_pictures_are_sent_on(simulation, run_onboard, make_camera, wait_until):
    sender = run_onboard("camera", "--port", "0", "--source", simulation.url)
    camera = make_camera(sender.port)
    wait_until(lambda: camera.received > 3, "pictures come")
    assert camera.image.peek().content.std() > 10, "the picture is not plain"
    assert json.loads(ask(sender.port)[1])["problem"] == ""


def test_a_lost_camera_is_told(run_onboard, make_camera, free_port, wait_until):
    sender = run_onboard("camera", "--port", "0", "--source", f"127.0.0.1:{free_port()}")
    make_camera(sender.port)
    wait_until(lambda: "connection refused" in ask(sender.port)[1], "the reason is told")


def test_a_robot_without_a_camera_is_told_and_not_asked_for_ever(wait_until, monkeypatch):
    monkeypatch.setattr(picture_sources, "NO_NEWS_TIMEOUT", 0.3)
    asked = []

    class NoCamera(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_response(500)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), NoCamera) as robot:
        robot.daemon_threads = True
        threading.Thread(target=robot.serve_forever, daemon=True).start()
        source = open_source(f"127.0.0.1:{robot.server_address[1]}", 30.0, (640, 480))
        source.watch()
        wait_until(lambda: "plugged in" in source.problem, "the problem")
        source.leave()
        source.close()
        count = len(asked)
        time.sleep(0.2)  # in which nobody may ask
        assert len(asked) == count
        robot.shutdown()


def test_a_camera_that_is_lost_again_and_again_is_soon_tried_again_after_each_picture(wait_until, monkeypatch):
    monkeypatch.setattr(picture_sources, "SHORTEST_BACK_OFF", 0.001)
    monkeypatch.setattr(picture_sources, "LONGEST_BACK_OFF", 1e6)  # twenty failures in a row take seventeen minutes
    opened = []

    def open_camera():
        opened.append(True)
        yield np.zeros((6, 4), np.uint8)
        raise CameraLost("the robot was switched off")

    source = PictureSource("camera", open_camera)
    source.watch()
    try:
        wait_until(lambda: len(opened) > 20, "it is tried again")
    finally:
        source.close()


def test_a_device_that_is_none_is_told(wait_until):
    source = open_source("/dev/no_such_camera", 30.0, (640, 480))
    source.watch()
    wait_until(lambda: "does not open" in source.problem, "the problem")
    source.close()


@pytest.mark.parametrize(("text", "rate"), [("test", 0.0), ("test", float("nan")), ("no address/", 30.0)])
def test_sources_that_make_no_sense_are_refused(text, rate):
    with pytest.raises(ValueError):
        open_source(text, rate, (640, 480))


@pytest.mark.parametrize("text", ["", "host:port", "https://host", "http://host/path", "a:1:2"])
def test_addresses_that_are_none_are_refused(text):
    with pytest.raises(ValueError, match="camera sender"):
        sender_url(text)
