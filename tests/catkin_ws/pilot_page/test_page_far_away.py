"""The page through the internet: a pilot at home and the station behind routers that translate addresses, with a relay.

The routers and the relay (coturn) are real, in network namespaces; see internet.py. The tests go on from one another,
as a long evening of one pilot would.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator

import pytest
from internet import GATEWAY, RELAY, RELAY_PORT, STATION, Internet
from page_browser import FORWARD, ZERO, Browser, assert_stands, drives, enter, heard

pytestmark = [pytest.mark.ros, pytest.mark.browser]

BACK = 25.0
"""[s], even on a busy machine, through routers and a relay."""
CUT = 10.0
SURE = 0.5


@pytest.fixture(scope="module")
def internet(tmp_path_factory):
    made = Internet(tmp_path_factory.mktemp("internet"))
    made.start_relay()
    with made.station.entered():
        yield made
    made.close()


@pytest.fixture(scope="module")
def graph(internet, graph):
    """The graph of the station, on its machine."""
    return graph


@pytest.fixture(scope="module")
def url(internet, page):
    words = ["--address", STATION, "--servers", f"turn:{RELAY}:{RELAY_PORT}", "--turn-secret", str(internet.secret)]
    port = int(page(*words).wait_for(r"https://192\.168\.1\.2:(\d+)/").group(1))
    internet.translate(port, strict=False)
    return f"https://{GATEWAY}:{port}/"


@pytest.fixture(scope="module")
def browser(internet, url):
    with internet.home.entered():
        browser = Browser(url)
    yield browser
    browser.tools.close()


@pytest.fixture
def pilot(browser, wait_until):
    wait_until(lambda: browser.is_there() or browser.asks(), "the page is there")
    return browser if browser.is_there() else enter(browser, wait_until)


def comes_back(probe, wait_until, browser, *ways: str) -> None:
    began = time.monotonic()
    probe.forget("/cmd_vel")
    wait_until(browser.is_there, "the page shows pictures and has the robot")
    assert time.monotonic() - began <= BACK
    time.sleep(SURE)
    assert FORWARD not in heard(probe)
    wait_until(lambda: browser.way() in ways, f"the page takes one of the ways {ways}")
    drives(probe, wait_until, browser)


def lets_go(probe, wait_until, browser) -> None:
    browser.key("KeyW", False)
    wait_until(lambda: heard(probe)[-1] == ZERO, "the release stops")


def test_both_behind_routers_find_a_direct_way(pilot, probe, wait_until):
    drives(probe, wait_until, pilot)
    wait_until(lambda: pilot.way() not in ("", "dialling"), "the page says which way it takes")
    assert pilot.way() == "direct"
    assert pilot.errors == []


def test_the_network_is_cut_for_ten_seconds(internet, pilot, probe, wait_until):
    @contextlib.contextmanager
    def cut() -> Iterator[None]:
        drives(probe, wait_until, pilot)
        with internet.cut():
            yield
            time.sleep(CUT)
            assert FORWARD not in heard(probe)[-5:]
        comes_back(probe, wait_until, pilot, "direct", "relay")

    assert_stands(probe, wait_until, cut)


def test_behind_strict_routers_a_relay_carries_everything(internet, url, pilot, probe, wait_until):
    lets_go(probe, wait_until, pilot)
    internet.translate(int(url.rstrip("/").rpartition(":")[2]), strict=True)
    pilot.tools.call("Page.reload")
    comes_back(probe, wait_until, pilot, "relay")


def test_the_relay_is_killed_and_started_again(internet, pilot, probe, wait_until):
    @contextlib.contextmanager
    def killed() -> Iterator[None]:
        drives(probe, wait_until, pilot)
        internet.kill_relay()
        yield
        time.sleep(SURE)
        internet.start_relay()
        comes_back(probe, wait_until, pilot, "relay")

    assert_stands(probe, wait_until, killed)


def test_without_a_relay_the_slower_way_is_taken_and_left_again(internet, pilot, probe, wait_until):
    internet.kill_relay()
    wait_until(lambda: heard(probe)[-1] == ZERO, "the robot is told to stand")
    wait_until(lambda: pilot.is_there() and pilot.way() == "slower", "the page works by the slower way")
    drives(probe, wait_until, pilot)
    lets_go(probe, wait_until, pilot)
    internet.start_relay()
    wait_until(lambda: pilot.is_there() and pilot.way() == "relay", "the page finds the relay again")
