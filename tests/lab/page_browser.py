"""The pilot's page in Chromium, as people use it, and a camera for it to show."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from open_page import OpenPage
from repeated_presses import press_until

from pepper_sim.tablet.devtools import DevTools

FORWARD = [0.2, 0.0, 0.0]
"""What the key W drives."""
ZERO = [0.0, 0.0, 0.0]
REST = 0.5
"""[s] after the last valid command within which the robot is told to stand."""
TRIES = 4
"""The best of so many counts, as other programs hold up those of a busy machine."""
FLAGS = (
    "--ignore-certificate-errors",  # the page's own one
    "--allow-loopback-in-peer-connection",
    "--disable-features=WebRtcHideLocalIpsWithMdns",
)


def camera_program(pixels: str) -> str:
    """Return a program that publishes Pepper's front camera, 160x120, twenty times a second.

    Args:
        pixels: Computes a picture's bytes, 120 rows of 480; `level` goes round from 0 to 195.
    """
    return f"""
import rospy, numpy as np
from sensor_msgs.msg import Image
rospy.init_node("pictures", anonymous=True)
publisher = rospy.Publisher("/pepper_robot/camera/front/image_raw", Image, queue_size=1)
rate, level = rospy.Rate(20), 0
while not rospy.is_shutdown():
    level = (level + 5) % 200
    message = Image(height=120, width=160, encoding="rgb8", step=480, data=({pixels}).tobytes())
    message.header.stamp = rospy.Time.now()
    publisher.publish(message)
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
"""


PICTURES = camera_program("np.full((120, 480), level, np.uint8)")
NOISE = camera_program("np.random.randint(0, 256, (120, 480), np.uint8)")
"""Pictures that take all that the encoder gives them."""


class Browser(OpenPage):
    def __init__(self, url: str, before: str = "", flags: Sequence[str] = ()) -> None:
        self.errors: list[str] = []
        self.tools = DevTools(self._note, (*FLAGS, *flags))
        try:
            self._open(url, before)
        except BaseException:
            self.tools.close()
            raise

    def _open(self, url: str, before: str) -> None:
        for domain in ("Page", "Runtime"):
            self.tools.call(f"{domain}.enable")
        self.tools.call("Emulation.setFocusEmulationEnabled", enabled=True)
        self.tools.call("Emulation.setDeviceMetricsOverride", width=1280, height=720, deviceScaleFactor=1, mobile=False)
        self.tools.call("Page.addScriptToEvaluateOnNewDocument", source=before)
        self.tools.call("Page.navigate", url=url)

    def _note(self, method: str, params: dict) -> None:
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(params)[:1000])

    def evaluate(self, expression: str, **more):
        """As if somebody had pressed something: a browser plays sound only then."""
        more = {"awaitPromise": True, "returnByValue": True, "userGesture": True} | more
        answer = self.tools.call("Runtime.evaluate", expression=expression, **more)
        return answer["result"].get("value")

    def key(self, code: str, down: bool) -> None:
        self.tools.call("Input.dispatchKeyEvent", type="keyDown" if down else "keyUp", code=code, key=code[-1].lower())

    def picture(self) -> bytes:
        return base64.b64decode(self.tools.call("Page.captureScreenshot")["data"])


def enter(browser: OpenPage, wait_until: Callable, name: str = "anna") -> OpenPage:
    """Sign in; who comes first gets the robot."""
    wait_until(lambda: browser.evaluate("!document.getElementById('enter').hidden"), "the page asks who it is")
    browser.sign_in(name)
    wait_until(browser.is_there, "the page shows pictures and has the robot")
    return browser


def heard(probe) -> list[list[float]]:
    """What the robot was asked for."""
    return [fields for _, fields in probe.seen("/cmd_vel")]


def hold_until(
    browser: OpenPage, wait_until: Callable, condition: Callable[[], bool], what: str, code: str = "KeyW"
) -> None:
    """Hold a key until something is so, see `press_until`."""

    def press() -> None:
        browser.key(code, False)
        browser.key(code, True)

    press_until(press, lambda: None, wait_until, condition, what)


def drives(probe, wait_until: Callable, browser: OpenPage) -> None:
    """Hold W until the robot drives."""
    probe.forget("/cmd_vel")
    hold_until(browser, wait_until, lambda: heard(probe)[-5:] == [FORWARD] * 5, "the key drives")


def assert_stands(probe, wait_until: Callable, fault: Callable[[], AbstractContextManager]) -> None:
    """While a fault lasts, which begins with a robot that drives and at whose end it may drive again, the robot is told
    to stand soon after the last command. On a busy machine that is so in the best of a few tries."""
    tries: list[float] = []  # s
    while not any(seconds <= REST for seconds in tries):
        assert len(tries) < TRIES, f"it is told to stand {tries} s after the last command"
        with fault():
            wait_until(lambda: heard(probe)[-1:] == [ZERO], "the robot is told to stand")
            last = max(when for when, fields in probe.seen("/cmd_vel") if fields == FORWARD)
            stood = min(when for when, fields in probe.seen("/cmd_vel") if fields == ZERO and when > last)
            tries.append(stood - last)


def let_go_of_the_stop(browser: OpenPage, wait_until: Callable) -> None:
    """Press it as long as it is pressed; for a second it takes no second press."""
    press = (
        "((stop) => { const down = stop.ariaPressed === 'true'; if (down) stop.click(); return !down; })(part('stop'))"
    )
    wait_until(lambda: browser.evaluate(press.replace("part", "document.getElementById")), "the red stop is reset")
    wait_until(lambda: browser.text("status") == "Ready.", "it may drive")
