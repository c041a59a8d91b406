"""A ROS graph with the real drive_lease, the page's program, and browsers; the robot is but its topics."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence

import pytest
from open_page import PASSWORD
from page_browser import PICTURES, Browser, enter

from telepresence.teleop.accounts import Users


@pytest.fixture(scope="module")
def page(graph, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    users = Users(folder / "users.db")
    users.add("anna", PASSWORD, "pilot")
    users.add("ben", PASSWORD, "pilot")
    users.add("will", PASSWORD, "watcher")
    graph.accounts = users.path
    programs = graph.workspace / "lib"
    graph.run(str(programs / "avatar_gui/drive_lease"), f"_users:={users.path}")
    graph.run(sys.executable, "-c", PICTURES)
    words = ["--port", str(graph.free_port()), "--certificates", str(folder / "tls")]
    return lambda *more: graph.run(str(programs / "pilot_page/pilot_page"), *words, "--users", str(users.path), *more)


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

    def make(before: str = "", flags: Sequence[str] = ()) -> Browser:
        opened.append(Browser(running[1], before, flags))
        return opened[-1]

    yield make
    for browser in opened:
        browser.tools.close()


@pytest.fixture(scope="module")
def anna(running, wait_until):
    """The page of somebody who has come in."""
    browser = Browser(running[1])
    with contextlib.closing(browser.tools):
        yield enter(browser, wait_until)
