"""The pilot's page in Debian's Firefox: see, drive, stop, speak and be seen, with WebRTC and without."""

from __future__ import annotations

import signal

import pytest
from firefox_page import FirefoxPage
from page_browser import FORWARD, ZERO, drives, enter, heard, let_go_of_the_stop

from telepresence.page.browser_link import SOMEWHERE
from telepresence.video.webrtc import address_towards

pytestmark = [pytest.mark.ros, pytest.mark.browser]

DIRECT, SLOWER = "direct", "slower"
REST = 0.5
"""[s] after the last valid command within which the robot is told to stand."""


@pytest.fixture
def firefox(running):
    opened = []

    def make(before: str = "") -> FirefoxPage:
        opened.append(FirefoxPage(running[1], before))
        return opened[-1]

    yield make
    for page in opened:
        page.browser.close()


def has_network() -> bool:
    """Whether this machine has an address that Firefox would name to a page."""
    try:
        address_towards(SOMEWHERE)
    except OSError:
        return False
    return True


def stands(probe, until_true) -> None:
    until_true(lambda: heard(probe)[-1:] == [ZERO], "the robot is told to stand")
    last = max(when for when, fields in probe.seen("/cmd_vel") if fields == FORWARD)
    assert min(when for when, fields in probe.seen("/cmd_vel") if fields == ZERO and when > last) - last <= REST


def test_anna_sees_drives_stops_and_is_killed(firefox, probe, until_true):
    anna = enter(firefox(), until_true)
    until_true(lambda: anna.way() == (DIRECT if has_network() else SLOWER), "the page says which way it takes")
    drives(probe, until_true, anna)
    anna.key("KeyW", False)
    stands(probe, until_true)
    drives(probe, until_true, anna)
    anna.evaluate("document.getElementById('stop').click()")
    until_true(lambda: "red stop" in anna.text("status"), "the page says so")
    stands(probe, until_true)
    let_go_of_the_stop(anna, until_true)
    drives(probe, until_true, anna)
    assert anna.errors == []
    anna.browser.signal(signal.SIGKILL)
    stands(probe, until_true)


def test_without_webrtc_she_drives_by_the_slower_way(firefox, probe, until_true):
    anna = enter(firefox("delete globalThis.RTCPeerConnection;"), until_true)
    until_true(lambda: anna.way() == SLOWER, "the page says so")
    drives(probe, until_true, anna)
    anna.key("KeyW", False)
    stands(probe, until_true)
    assert anna.errors == []
