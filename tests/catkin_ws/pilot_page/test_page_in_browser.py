"""The pilot's page as people use it: Chromium, a ROS graph, the real drive_lease; the robot is but its topics."""

from __future__ import annotations

import base64
import signal
import sys
import time

import pytest

from pepper_sim.tablet.devtools import DevTools
from telepresence.teleop.accounts import Users

pytestmark = [pytest.mark.ros, pytest.mark.browser]

PASSWORD = "correct horse"
FORWARD = [0.2, 0.0, 0.0]
ZERO = [0.0, 0.0, 0.0]
REST = 0.5
"""Seconds after the last valid command within which the robot is told to stand."""
FLAGS = (
    "--ignore-certificate-errors",  # the page's own one
    "--allow-loopback-in-peer-connection",
    "--disable-features=WebRtcHideLocalIpsWithMdns",
)
PICTURES = """
import rospy, numpy as np
from sensor_msgs.msg import Image
rospy.init_node("pictures")
publisher = rospy.Publisher("/pictures", Image, queue_size=1)
rate, level = rospy.Rate(20), 0
while not rospy.is_shutdown():
    level = (level + 5) % 200
    pixels = np.full((120, 480), level, np.uint8).tobytes()
    message = Image(height=120, width=160, encoding="rgb8", step=480, data=pixels)
    message.header.stamp = rospy.Time.now()
    publisher.publish(message)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
"""


class Browser:
    def __init__(self, url: str) -> None:
        self.errors: list[str] = []
        self.tools = DevTools(self._note, FLAGS)
        for domain in ("Page", "Runtime"):
            self.tools.call(f"{domain}.enable")
        self.tools.call("Emulation.setFocusEmulationEnabled", enabled=True)
        self.tools.call("Emulation.setDeviceMetricsOverride", width=1280, height=720, deviceScaleFactor=1, mobile=False)
        self.tools.call("Page.navigate", url=url)

    def _note(self, method: str, params: dict) -> None:
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(params)[:1000])

    def evaluate(self, expression: str):
        answer = self.tools.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        return answer["result"].get("value")

    def text(self, part: str) -> str:
        return self.evaluate(f"document.getElementById('{part}')?.textContent ?? ''")

    def sign_in(self, name: str, password: str = PASSWORD) -> None:
        self.evaluate(
            f"document.querySelector('[name=name]').value = '{name}';"
            f"document.querySelector('[name=password]').value = '{password}';"
            "document.querySelector('#enterForm button').click()"
        )

    def width(self) -> int:
        return self.evaluate("document.getElementById('picture')?.videoWidth ?? 0") or 0

    def key(self, code: str, down: bool) -> None:
        self.tools.call("Input.dispatchKeyEvent", type="keyDown" if down else "keyUp", code=code, key=code[-1].lower())

    def picture(self) -> bytes:
        return base64.b64decode(self.tools.call("Page.captureScreenshot")["data"])


@pytest.fixture(scope="module")
def page(graph, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    users = Users(folder / "users.db")
    users.add("anna", PASSWORD, "pilot")
    users.add("will", PASSWORD, "watcher")
    programs = graph.workspace / "lib"
    graph.run(str(programs / "avatar_gui/drive_lease"), f"_users:={users.path}")
    graph.run(sys.executable, "-c", PICTURES)
    words = ["--picture", "/pictures", "--port", str(graph.free_port()), "--certificates", str(folder / "tls")]
    return lambda: graph.run(str(programs / "pilot_page/pilot_page"), *words, "--users", str(users.path))


@pytest.fixture(scope="module")
def running(page):
    started = page()
    return started, started.wait_for(r"https://127\.0\.0\.1:\d+/").group()


@pytest.fixture(scope="module")
def probe(graph):
    probe = graph.probe()
    probe.watch("/cmd_vel", "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    return probe


@pytest.fixture
def open_page(running):
    opened = []

    def make() -> Browser:
        opened.append(Browser(running[1]))
        return opened[-1]

    yield make
    for browser in opened:
        browser.tools.close()


@pytest.fixture
def anna(open_page, until_true):
    browser = open_page()
    until_true(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in("anna")
    until_true(lambda: browser.width() == 160, "the picture is there")
    until_true(lambda: browser.evaluate("document.getElementById('take').hidden"), "a free robot is taken")
    return browser


def heard(probe):
    return [fields for _, fields in probe.seen("/cmd_vel")]


def drives(probe, until_true, browser):
    probe.forget("/cmd_vel")
    browser.key("KeyW", True)
    until_true(lambda: heard(probe)[-5:] == [FORWARD] * 5, "the key drives")


def test_a_newcomer_signs_in_sees_and_drives(anna, probe, until_true):
    drives(probe, until_true, anna)
    anna.key("KeyW", False)
    until_true(lambda: heard(probe)[-1] == ZERO, "the release stops")
    assert anna.errors == [] and anna.text("age").endswith("ms")


def test_a_wrong_password_shows_no_picture(open_page, until_true):
    browser = open_page()
    until_true(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in("anna", "wrong horse")
    until_true(lambda: browser.text("enterProblem"), "it says no")
    assert browser.width() == 0 and browser.evaluate("document.getElementById('drive').hidden")


def test_a_watcher_sees_and_cannot_drive(open_page, probe, until_true):
    browser = open_page()
    until_true(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in("will")
    until_true(lambda: browser.width() == 160, "the picture is there")
    until_true(lambda: "may watch, not drive" in browser.text("status"), "it says so")
    probe.forget("/cmd_vel")
    browser.key("KeyW", True)
    time.sleep(0.5)  # of trying to drive
    browser.key("KeyW", False)
    assert FORWARD not in heard(probe)


@pytest.mark.parametrize("fault", ["hidden", "killed", "frozen"])
def test_the_robot_stands_when_the_page_is_not_looked_at(anna, probe, until_true, fault):
    drives(probe, until_true, anna)
    began = time.monotonic()
    if fault == "hidden":
        anna.tools.call("Emulation.setFocusEmulationEnabled", enabled=False)
        anna.evaluate(
            "Object.defineProperty(document, 'hidden', { get: () => true });"
            "document.dispatchEvent(new Event('visibilitychange'))"
        )
    else:
        anna.tools.signal(signal.SIGKILL if fault == "killed" else signal.SIGSTOP)
    until_true(lambda: heard(probe)[-1] == ZERO, "the robot is told to stand")
    last = max(when for when, fields in probe.seen("/cmd_vel") if fields == FORWARD)
    stood = min(when for when, fields in probe.seen("/cmd_vel") if fields == ZERO and when > last)
    assert stood - last <= REST and time.monotonic() > began
    if fault == "frozen":
        time.sleep(0.5)  # longer than the page takes for a hiccup
        probe.forget("/cmd_vel")
        anna.tools.signal(signal.SIGCONT)
        time.sleep(1.0)  # what a page that wakes up would send
        assert FORWARD not in heard(probe)


def test_the_end_of_the_page_s_program_stops_the_robot_and_the_page_comes_back(running, page, anna, probe, until_true):
    drives(probe, until_true, anna)
    running[0].kill()
    until_true(lambda: heard(probe)[-1] == ZERO, "the robot is told to stand")
    anna.key("KeyW", False)
    page().wait_for("https://")
    until_true(lambda: anna.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is, again")
    anna.sign_in("anna")
    until_true(lambda: anna.width() == 160, "the picture is there")
