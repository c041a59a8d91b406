"""Both robots behind one page, one tap apart, and what their surroundings know of who looks."""

from __future__ import annotations

import sys
import time

import pytest
from page_browser import FORWARD, PICTURES, ZERO, Browser, enter, hold_until

pytestmark = [pytest.mark.ros, pytest.mark.browser]


@pytest.fixture(scope="module")
def both(graph, page):
    """The page's address; Robotino has its topics elsewhere than usual."""
    lease = str(graph.workspace / "lib/avatar_gui/drive_lease")
    graph.run(lease, "__ns:=/rto9", "_sign_in:=true", f"_users:={graph.accounts}")
    graph.run(sys.executable, "-c", PICTURES, "__name:=more", "/pepper_robot/camera/front/image_raw:=/rto9/image_raw")
    started = page("--robots", "pepper", "robotino:/rto9:image_raw")
    return started.wait_for(r"https://127\.0\.0\.1:\d+/").group()


def test_the_other_robot_is_one_tap_away(graph, both, wait_until):
    probe = graph.probe()
    for topic in ("/cmd_vel", "/rto9/cmd_vel"):
        probe.watch(topic, "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])
    for namespace in ("", "/rto9"):
        probe.watch(f"{namespace}/looking", "std_msgs/String", ["data"])
        probe.watch(f"{namespace}/drive/state", "telepresence_msgs/DriveState", ["pilot"])

    def last(topic: str) -> list:
        seen = probe.seen(topic)
        return seen[-1][1] if seen else []

    def press_again() -> bool:
        browser.key("KeyW", False)
        browser.key("KeyW", True)
        time.sleep(0.3)  # from the key to the wheels
        return True

    browser = Browser(both)
    try:
        enter(browser, wait_until)
        assert browser.evaluate("document.title") == "Pepper – pilot"
        wait_until(lambda: last("/looking") == ["anna"], "Pepper's surroundings know who looks")
        hold_until(browser, wait_until, lambda: last("/cmd_vel") == FORWARD, "Pepper drives")
        browser.evaluate("document.querySelector('#robots [data-robot=Robotino]').click()")
        wait_until(lambda: last("/cmd_vel") == ZERO, "Pepper is told to stand")
        wait_until(browser.is_there, "Robotino's pictures are there, and nobody else had it")
        wait_until(lambda: last("/drive/state") == [""] and last("/rto9/drive/state") == ["anna"], "Pepper is free")
        wait_until(lambda: last("/looking") == [""] and last("/rto9/looking") == ["anna"], "who looks has changed")
        assert last("/rto9/cmd_vel") in ([], ZERO), "a key that was held for Pepper does not drive Robotino"
        browser.key("KeyW", False)
        wait_until(lambda: press_again() and last("/rto9/cmd_vel") == FORWARD, "Robotino drives")
        browser.key("KeyW", False)
        browser.tools.call("Page.reload")
        wait_until(browser.is_there, "the page is there again")
        assert browser.evaluate("document.title") == "Robotino – pilot"
        assert browser.errors == []
    finally:
        browser.tools.close()
    wait_until(lambda: last("/rto9/looking") == [""], "nobody looks any more")
