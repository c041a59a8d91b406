"""The ROS programs as people start them, on a real ROS graph."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import signal
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
import qi
from endings import end_together
from one_colour_camera import publish_colour
from tablet_robot import tablet_robot
from telepresence_1.page import KEY_VARIABLE

from pepper_sim.tablet.tablet import Tablet
from telepresence.web.page_auth import make_token

pytestmark = pytest.mark.ros

KEY = make_token()
ORANGE, BLACK, GREEN = (230, 130, 20), (0, 0, 0), (20, 180, 60)
FACE = f"""
import cv2, numpy as np, rospy
from sensor_msgs.msg import CompressedImage
rospy.init_node("face", anonymous=True)
publisher = rospy.Publisher("/com_cam/face", CompressedImage, queue_size=1)
data = cv2.imencode(".jpg", np.full((480, 640, 3), {GREEN[::-1]}, np.uint8))[1].tobytes()
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    message = CompressedImage(format="jpeg", data=data)
    message.header.stamp = rospy.Time.now()
    publisher.publish(message)
    rate.sleep()
"""


@pytest.fixture
def source(tmp_path: Path) -> str:
    """A still picture for a camera."""
    path = tmp_path / "pilot.png"
    cv2.imwrite(str(path), np.full((480, 640, 3), ORANGE[::-1], np.uint8))
    return str(path)


@pytest.fixture
def tablet(naoqi) -> Iterator[Tablet]:
    with tablet_robot(naoqi) as tablet:
        yield tablet


def colour(tablet: Tablet) -> tuple[int, ...]:
    picture = tablet.image.peek()
    return (0, 0, 0) if picture is None else tuple(int(v) for v in picture.content[200, 320])


def close_to(colour: tuple[int, ...], wanted: tuple[int, ...]) -> bool:
    return max(abs(a - b) for a, b in zip(colour, wanted, strict=True)) < 15


def program(graph, name: str) -> str:
    return str(graph.workspace / "lib" / "telepresence_1" / name)


def get(url: str, path: str) -> bytes:
    connection = http.client.HTTPConnection(url.split("/")[2], timeout=30)
    connection.request("GET", path)
    body = connection.getresponse().read()
    connection.close()
    return body


@pytest.fixture(autouse=True)
def key(graph, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `./stack up` hands it to the nodes."""
    monkeypatch.setitem(graph.environment, KEY_VARIABLE, KEY)


@pytest.fixture(autouse=True)
def own_nodes(graph) -> Iterator[None]:
    """The nodes of one test end with it, and leave no parameters to those of another: one that runs on keeps what was
    set in it."""
    before = len(graph.programs)
    yield
    end_together([program.process for program in graph.programs[before:]])
    for node in ("/com_cam", "/rob_cam"):
        graph.forget_parameters(node)


def test_com_cam_brings_the_pilot_to_the_tablet(
    graph, naoqi, tablet: Tablet, add_life: Callable, source: str, wait_until: Callable
) -> None:
    life = add_life("robotvideo/behaviour")
    probe = graph.probe()
    probe.watch("/com_cam/status", "diagnostic_msgs/DiagnosticStatus", ["level", "message"])
    arguments = (f"_source:={source}", f"_nao_port:={naoqi.port}", "_port:=0", "_name:=Anna")
    node = graph.run(program(graph, "com_cam.py"), *arguments)
    url = node.wait_for(r"the page is at (http://127\.0\.0\.1:\d+/)")[1]
    wait_until(lambda: close_to(colour(tablet), ORANGE), "the picture is on the tablet")
    status = json.loads(get(url, f"/status?k={KEY}"))
    assert status["name"] == "Anna" and status["state"] == "live" and status["viewers"] == 1
    assert b"Not for everyone" in get(url, "/status"), "a page on loopback has a key, too"
    wait_until(lambda: probe.latest("/com_cam/status")[1] == "Live; on the tablet", "the status says so")
    assert probe.latest("/com_cam/status")[0] in (0, [0])
    assert life.focus == "robotvideo/behaviour"
    tablet.hide_webview()
    wait_until(lambda: colour(tablet) == (0, 0, 0), "somebody hides it")
    wait_until(lambda: close_to(colour(tablet), ORANGE), "it is shown again")
    main = graph.run(program(graph, "main.py"), f"--qi-url=127.0.0.1:{naoqi.port}")
    main.wait_for("the tablet shows " + url)
    main.signal(signal.SIGINT)
    assert main.process.wait(30) == 0 and main.output.endswith("Application finished.\n")
    assert tablet.visible and life.focus == "robotvideo/behaviour", "com_cam goes on showing its page"
    switch = graph.run("rosservice", "call", "/com_cam/show_on_tablet", "data: false")
    assert switch.process.wait(30) == 0 and "success: True" in switch.output
    off = "Camera off; not on the tablet: switched off"
    wait_until(lambda: probe.latest("/com_cam/status")[1] == off, "switched off")
    assert probe.latest("/com_cam/status")[0] in (0, [0]), "that is as it was wanted"
    wait_until(lambda: colour(tablet) == (0, 0, 0) and life.focus == "", "the tablet is dark")
    node.kill()
    node = graph.run(program(graph, "com_cam.py"), *arguments)
    probe.forget("/com_cam/status")
    wait_until(lambda: probe.newest("/com_cam/status")[1].endswith("switched off"), "nor does it come back by itself")
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0
    assert "Traceback" not in node.output and node.output.endswith("Exit\n")


def test_a_com_cam_that_died_with_a_face_from_elsewhere_takes_the_page_away(
    graph, naoqi, tablet: Tablet, source: str, wait_until: Callable
) -> None:
    probe = graph.probe()
    probe.watch("/com_cam/status", "diagnostic_msgs/DiagnosticStatus", ["level", "message"])
    words = (f"_source:={source}", f"_nao_port:={naoqi.port}", "_port:=0", "_show_on_tablet:=false")
    node = graph.run(program(graph, "com_cam.py"), *words)
    face = graph.run(sys.executable, "-c", FACE)
    wait_until(lambda: close_to(colour(tablet), GREEN), "the face is on the tablet")
    wait_until(lambda: probe.latest("/com_cam/status")[1].startswith("Live; on the tablet"), "com_cam knows")
    node.kill()
    face.kill()
    node = graph.run(program(graph, "com_cam.py"), *words)
    seen = []
    wait_until(lambda: seen.append(colour(tablet)) or not tablet.visible, "the page is taken away")
    assert not any(close_to(one, ORANGE) for one in seen), "nobody has asked for this machine's camera"


class Viewer:
    """Somebody who keeps the page's stream open, as a hidden web view does."""

    def __init__(self, url: str) -> None:
        self.pictures: list[tuple[float, tuple[int, ...]]] = []
        """When each was taken [s since 1970], and its colour in the middle."""
        self._response = urllib.request.urlopen(f"{url}/video_feed?k={KEY}", timeout=30)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with contextlib.suppress(OSError, http.client.HTTPException, AttributeError), self._response:
            while line := self._response.readline():
                if line.startswith(b"Content-Length"):
                    size = int(line.split()[1])
                    stamp = float(self._response.readline().split()[1])
                    self._response.readline()
                    picture = cv2.imdecode(np.frombuffer(self._response.read(size), np.uint8), cv2.IMREAD_COLOR)
                    self.pictures.append((stamp, tuple(int(v) for v in picture[240, 20, ::-1])))

    def orange(self, since: float) -> list[bool]:
        return [close_to(colour, ORANGE) for stamp, colour in list(self.pictures) if stamp > since]


def test_com_cam_films_only_while_its_page_is_wanted(
    graph, naoqi, tablet: Tablet, open_page, jpeg, wait_until: Callable
) -> None:
    camera = open_page()  # a network camera that knows whether it films for anybody
    camera.image.put(jpeg(ORANGE))
    words = (f"_source:={camera.server.url}video_feed", f"_nao_port:={naoqi.port}", "_port:=0")
    node = graph.run(program(graph, "com_cam.py"), *words, "_show_on_tablet:=false")
    viewer = Viewer(node.wait_for(r"the page is at (http://127\.0\.0\.1:\d+)/")[1])

    def switch(on: bool) -> float:
        done = graph.run("rosservice", "call", "/com_cam/show_on_tablet", f"data: {str(on).lower()}")
        assert done.process.wait(30) == 0 and "success: True" in done.output
        return time.time()

    wait_until(lambda: len(viewer.pictures) > 5, "the page goes on with a notice")
    assert camera.stream.viewers == 0 and not any(viewer.orange(0.0)), "the camera is open, and nobody has asked for it"
    on = switch(True)
    wait_until(lambda: close_to(colour(tablet), ORANGE) and any(viewer.orange(on)), "the pilot is on the tablet")
    off = switch(False)
    wait_until(lambda: camera.stream.viewers == 0 and not tablet.visible, "camera and tablet are off")
    wait_until(lambda: len(viewer.orange(off)) > 5, "who kept the stream open gets more pictures")
    assert not any(viewer.orange(off)), "and they show the pilot"
    tablet.show_webview()
    wait_until(lambda: tablet.visible, "any program shows the web view")
    assert "/blank" in tablet.url and not close_to(colour(tablet), ORANGE)


def test_com_cam_names_who_looks_by_the_pilots_page_until_that_dies(graph, wait_until: Callable) -> None:
    node = graph.run(program(graph, "com_cam.py"), "_source:=test", "_port:=0", "_show_on_tablet:=false")
    url = node.wait_for(r"the page is at (http://127\.0\.0\.1:\d+/)")[1]

    def looking() -> list[str]:
        return json.loads(get(url, f"/status?k={KEY}"))["looking"]

    page = graph.run("rostopic", "pub", "/looking", "std_msgs/String", 'data: "anna\\nben\\e[31m"')
    wait_until(lambda: looking() == ["anna", "ben\ufffd[31m"], "both are named, and no more than their names")
    page.kill()
    wait_until(lambda: looking() == [], "nobody says so any more")


def test_only_the_tablet_has_the_key(graph, naoqi, tablet: Tablet, source: str, wait_until: Callable) -> None:
    arguments = (f"_source:={source}", f"_nao_port:={naoqi.port}", "_port:=0", "_token:=se cret&", "__name:=locked")
    node = graph.run(program(graph, "com_cam.py"), *arguments)
    url = node.wait_for(r"the page is at (http://127\.0\.0\.1:\d+/)\s")[1]
    wait_until(lambda: close_to(colour(tablet), ORANGE), "the picture is on the tablet")
    assert b"Not for everyone" in get(url, "/") and b"Not for everyone" in get(url, "/frame.jpg")
    node.wait_for(r"another browser: http://127\.0\.0\.1:\d+/\?k=se\+cret%26\s")
    assert len(re.findall("cret", node.output)) == 1, "the key is in a log"


def test_com_cam_without_camera_and_robot_serves_a_picture_that_says_so(graph, free_port: Callable) -> None:
    port = free_port()
    node = graph.run(program(graph, "com_cam.py"), "_source:=7", f"_nao_port:={port}", "_port:=0")
    url = node.wait_for(r"the page is at (http://127\.0\.0\.1:\d+/)")[1]
    node.wait_for("no camera at /dev/video7")
    node.wait_for(f"cannot reach the robot at tcp://127.0.0.1:{port}")
    picture = cv2.imdecode(np.frombuffer(get(url, f"/frame.jpg?k={KEY}"), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (480, 640, 3) and picture.std() > 10
    node.signal(signal.SIGTERM)
    assert node.process.wait(30) == 0
    assert "Traceback" not in node.output


def test_com_cam_finds_a_robot_that_comes_later(
    graph, source: str, make_connection: Callable, naoqi, tablet: Tablet, wait_until: Callable
) -> None:
    wire = make_connection(naoqi.port)
    graph.run(program(graph, "com_cam.py"), f"_source:={source}", f"_nao_port:={wire.port}", "_port:=0")
    wait_until(lambda: close_to(colour(tablet), ORANGE), "the picture is on the tablet")
    wire.freeze()
    tablet.hide_webview()
    wait_until(lambda: colour(tablet) == (0, 0, 0), "dark")
    wire.thaw()
    wire.cut()
    wait_until(lambda: close_to(colour(tablet), ORANGE), "shown again on the new link")


def test_a_taken_port_ends_the_program_with_a_reason(graph) -> None:
    first = graph.run(program(graph, "com_cam.py"), "_port:=0", "_show_on_tablet:=false", "__name:=first")
    port = first.wait_for(r"the page is at http://127\.0\.0\.1:(\d+)/")[1]
    second = graph.run(program(graph, "com_cam.py"), f"_port:={port}", "_show_on_tablet:=false", "__name:=second")
    assert second.process.wait(30) == 1
    assert f"cannot listen on 127.0.0.1, port {port}" in second.output and "Traceback" not in second.output


def test_main_shows_any_page_until_ended(
    graph, naoqi, tablet: Tablet, add_life: Callable, open_page, jpeg, wait_until: Callable
) -> None:
    life = add_life("robotvideo/behaviour")
    page = open_page()
    page.image.put(jpeg(ORANGE))
    url = f"--url={page.server.url}"
    node = graph.run(program(graph, "main.py"), f"--qi-url=tcp://127.0.0.1:{naoqi.port}", url)
    wait_until(lambda: close_to(colour(tablet), ORANGE), "the page is shown")
    assert life.focus == "robotvideo/behaviour"
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0 and node.output.endswith("Application finished.\n")
    wait_until(lambda: colour(tablet) == (0, 0, 0), "the page is taken away")
    assert life.focus == ""


def test_rob_cam_without_a_display_is_a_web_page(graph, monkeypatch: pytest.MonkeyPatch, wait_until: Callable) -> None:
    monkeypatch.setitem(graph.environment, "DISPLAY", "")
    node = graph.run(program(graph, "rob_cam.py"), "_image:=/camera", "_port:=0")
    url = node.wait_for(r"look at (http://127\.0\.0\.1:\d+/) instead")[1]

    def shown() -> tuple[int, ...]:
        data = get(url, f"/frame.jpg?k={KEY}")
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        return (0, 0, 0) if picture is None else tuple(int(v) for v in picture[100, 100, ::-1])

    wait_until(lambda: json.loads(get(url, f"/status?k={KEY}"))["state"] == "lost", "nothing comes yet")
    robot = publish_colour(graph, "/camera", ORANGE)
    wait_until(lambda: close_to(shown(), ORANGE), "the robot's picture is on the page")
    robot.kill()
    wait_until(lambda: json.loads(get(url, f"/status?k={KEY}"))["state"] == "lost", "the picture is lost")
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0
    assert "Traceback" not in node.output


class VideoDevice:
    """An ALVideoDevice whose camera sees one colour."""

    def __init__(self) -> None:
        self.subscribed: list[tuple] = []

    def getSubscribers(self) -> list[str]:
        return []

    def subscribeCamera(self, *settings: object) -> str:
        self.subscribed.append(settings)
        return "pyth12_0"

    @qi.bind("(iiiiiiriffff)", ["s"])
    def getImageRemote(self, _handle: str) -> tuple:
        seconds, nanoseconds = divmod(time.time_ns(), 10**9)
        pixels = np.full((480, 640, 3), ORANGE, np.uint8).tobytes()
        return (640, 480, 3, 11, seconds, nanoseconds // 1000, pixels, 0, 0.4, 0.3, -0.4, -0.3)

    def unsubscribe(self, handle: str) -> None:
        self.subscribed.remove(self.subscribed[0])


def test_rob_cam_opens_the_camera_of_the_robot_that_it_is_given(
    graph, naoqi, monkeypatch: pytest.MonkeyPatch, wait_until: Callable
) -> None:
    monkeypatch.setitem(graph.environment, "DISPLAY", "")
    monkeypatch.setitem(graph.environment, "ROS_MASTER_URI", f"http://127.0.0.1:{graph.free_port()}")
    camera = VideoDevice()
    naoqi.register("ALVideoDevice", camera)
    node = graph.run(program(graph, "rob_cam.py"), "127.0.0.1", str(naoqi.port), "--page-port=0")
    url = node.wait_for(r"look at (http://127\.0\.0\.1:\d+/) instead")[1]

    def shown() -> bool:
        picture = cv2.imdecode(np.frombuffer(get(url, f"/frame.jpg?k={KEY}"), np.uint8), cv2.IMREAD_COLOR)
        return picture.shape == (480, 640, 3) and close_to(tuple(int(v) for v in picture[100, 100, ::-1]), ORANGE)

    wait_until(shown, "what the camera sees is on the page")
    assert camera.subscribed == [("pyth12", 0, 2, 11, 15)], "as in the report"
    node.signal(signal.SIGINT)
    assert node.process.wait(30) == 0 and not camera.subscribed
    assert "Traceback" not in node.output
