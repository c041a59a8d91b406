"""The pilot's page in Debian's Firefox: see, drive, stop, speak and be seen, with WebRTC and without."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator

import pytest
from firefox_page import FirefoxPage
from page_browser import assert_stands, drives, enter, let_go_of_the_stop

from telepresence.page.browser_link import SOMEWHERE
from telepresence.video.webrtc import address_towards

pytestmark = [pytest.mark.ros, pytest.mark.browser]

DIRECT, SLOWER = "direct", "slower"


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


@contextlib.contextmanager
def released(probe, until_true, browser) -> Iterator[None]:
    drives(probe, until_true, browser)
    browser.key("KeyW", False)
    yield


def test_anna_sees_drives_stops_and_is_killed(firefox, probe, until_true):
    anna = enter(firefox(), until_true)

    @contextlib.contextmanager
    def stopped() -> Iterator[None]:
        drives(probe, until_true, anna)
        anna.evaluate("document.getElementById('stop').click()")
        until_true(lambda: "red stop" in anna.text("status"), "the page says so")
        yield
        let_go_of_the_stop(anna, until_true)

    @contextlib.contextmanager
    def killed() -> Iterator[None]:
        other = enter(firefox(), until_true)
        drives(probe, until_true, other)
        other.browser.signal(signal.SIGKILL)
        yield

    until_true(lambda: anna.way() == (DIRECT if has_network() else SLOWER), "the page says which way it takes")
    assert_stands(probe, until_true, lambda: released(probe, until_true, anna))
    assert_stands(probe, until_true, stopped)
    assert anna.errors == []
    anna.evaluate("document.getElementById('leave').click()")
    assert_stands(probe, until_true, killed)


def test_without_webrtc_she_drives_by_the_slower_way(firefox, probe, until_true):
    anna = enter(firefox("delete globalThis.RTCPeerConnection;"), until_true)
    until_true(lambda: anna.way() == SLOWER, "the page says so")
    assert_stands(probe, until_true, lambda: released(probe, until_true, anna))
    assert anna.errors == []
