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
def released(probe, wait_until, browser) -> Iterator[None]:
    drives(probe, wait_until, browser)
    browser.key("KeyW", False)
    yield


def test_anna_sees_drives_stops_and_is_killed(firefox, probe, wait_until):
    anna = enter(firefox(), wait_until)

    @contextlib.contextmanager
    def stopped() -> Iterator[None]:
        drives(probe, wait_until, anna)
        anna.evaluate("document.getElementById('stop').click()")
        wait_until(lambda: "red stop" in anna.text("status"), "the page says so")
        yield
        let_go_of_the_stop(anna, wait_until)

    @contextlib.contextmanager
    def killed() -> Iterator[None]:
        other = enter(firefox(), wait_until)
        drives(probe, wait_until, other)
        other.browser.signal(signal.SIGKILL)
        yield

    wait_until(lambda: anna.way() == (DIRECT if has_network() else SLOWER), "the page says which way it takes")
    assert_stands(probe, wait_until, lambda: released(probe, wait_until, anna))
    assert_stands(probe, wait_until, stopped)
    assert anna.errors == []
    anna.evaluate("document.getElementById('leave').click()")
    assert_stands(probe, wait_until, killed)


def test_without_webrtc_she_drives_by_the_slower_way(firefox, probe, wait_until):
    anna = enter(firefox("delete globalThis.RTCPeerConnection;"), wait_until)
    wait_until(lambda: anna.way() == SLOWER, "the page says so")
    assert_stands(probe, wait_until, lambda: released(probe, wait_until, anna))
    assert anna.errors == []
