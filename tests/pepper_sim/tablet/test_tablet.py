"""What the tablet shows, and when."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from waiting import comes_true

from pepper_sim.tablet import chromium
from pepper_sim.tablet.devtools import BrowserError
from pepper_sim.tablet.tablet import Tablet

RED = (255, 0, 0)
GREEN = (0, 255, 0)
BLUE = (0, 0, 255)
BLACK = (0, 0, 0)


def test_shows_at_most_fifteen_pictures_a_second_and_always_the_last(live, glass, encoded) -> None:
    image, server = live
    image.put(encoded(BLACK))
    glass.open(server.url)
    assert glass.shows(BLACK)
    before, begin = len(glass.shown), time.monotonic()
    for number in range(100):
        image.put(encoded((number, 0, 0)))
        time.sleep(0.005)
    image.put(encoded(GREEN))
    assert glass.shows(GREEN)
    assert len(glass.shown) - before <= (time.monotonic() - begin) * 15 + 2


def test_letterboxes_a_narrow_picture_on_the_background(site, glass, encoded) -> None:
    site.serve("/", encoded(RED, 640, 480, ".png"), "image/png")
    glass.tablet.set_background("#0000fF")
    glass.open(site.url())
    assert glass.shows(RED)
    screen = glass.tablet.image.peek().content
    assert tuple(screen[200, 10]) == BLUE and tuple(screen[200, 630]) == BLUE
    assert tuple(screen[0, 320]) == RED and tuple(screen[399, 320]) == RED
    assert (screen[200] == RED).all(axis=1).sum() == 533


class SlowBrowser:
    """Stands for a Chromium that starts when it is told to, and never loads a page."""

    alive = True

    def __init__(self, *_: object, **__: object) -> None:
        self.begun.set()
        assert self.may_start.wait(60)

    def call(self, method: str, **_: object) -> dict:
        if method == self.refused:
            raise BrowserError(method)
        return {}

    def close(self) -> None:
        self.closed.set()


@pytest.fixture
def slow_browser(monkeypatch) -> Iterator[type[SlowBrowser]]:
    for event in ("begun", "may_start", "closed"):
        monkeypatch.setattr(SlowBrowser, event, threading.Event(), raising=False)
    monkeypatch.setattr(SlowBrowser, "refused", "", raising=False)
    monkeypatch.setattr(chromium, "DevTools", SlowBrowser)
    yield SlowBrowser
    SlowBrowser.may_start.set()


def test_the_tablet_is_used_while_its_browser_starts(slow_browser, make_glass) -> None:
    glass = make_glass("chromium")
    glass.open("http://127.0.0.1/first")
    assert slow_browser.begun.wait(30)

    def use() -> None:
        glass.open("http://127.0.0.1/second")
        glass.tablet.hide_webview()

    using = threading.Thread(target=use)
    using.start()
    waited = not comes_true(lambda: not using.is_alive(), timeout=10)
    slow_browser.may_start.set()
    using.join()
    assert not waited


def test_a_browser_that_refuses_its_first_request_is_ended(slow_browser, make_glass) -> None:
    slow_browser.refused = "Page.enable"
    slow_browser.may_start.set()
    make_glass("chromium").open("http://127.0.0.1/")
    assert slow_browser.closed.wait(30)


@pytest.mark.parametrize(
    "url", ["file:///etc/passwd", "data:text/html,x", "127.0.0.1", "http://", "http://a b/", "http://x:99999/", ""]
)
def test_refuses_what_is_no_web_address(url: str, glass) -> None:
    assert not glass.tablet.load_url(url)
    assert not glass.tablet.show_image(url)
    assert glass.tablet.url is None


def test_an_image_covers_the_page_until_hidden(site, glass, wait_until, encoded) -> None:
    site.serve("/page", "<img src=red>")
    site.serve("/red", encoded(RED), "image/jpeg")
    transparent = np.zeros((400, 640, 4), np.uint8)
    site.serve("/transparent", cv2.imencode(".png", transparent)[1].tobytes(), "image/png")
    glass.open(site.url("/page"))
    assert glass.shows(RED)
    glass.tablet.set_background("#00FF00")
    assert glass.tablet.show_image(site.url("/transparent"))
    assert glass.shows(GREEN)
    wait_until(lambda: "image" in glass.events)
    glass.tablet.hide_image()
    assert glass.shows(RED)
    glass.tablet.hide_webview()
    assert glass.shows(BLACK)
    assert glass.shown[-1] is None and not glass.tablet.visible


def test_a_page_loaded_while_hidden_is_there_when_shown(site, glass, wait_until, encoded) -> None:
    site.serve("/", encoded(BLUE), "image/jpeg")
    glass.tablet.load_url(site.url())
    wait_until(lambda: glass.events == ["started", "finished"])
    assert glass.shown == []
    glass.tablet.show_webview()
    assert glass.shows(BLUE)


def test_reload_asks_again(site, glass, encoded) -> None:
    site.serve("/", encoded(BLUE), "image/jpeg")
    glass.open(site.url())
    assert glass.shows(BLUE)
    site.serve("/", encoded(RED), "image/jpeg")
    glass.tablet.reload(True)
    assert glass.shows(RED)


def test_a_new_address_replaces_a_page_that_hangs(site, glass, wait_until, encoded) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        glass.open(f"http://127.0.0.1:{silent.getsockname()[1]}/")
        wait_until(lambda: glass.events == ["started"])
        site.serve("/", encoded(GREEN), "image/jpeg")
        glass.open(site.url())
        assert glass.shows(GREEN)
    assert glass.events == ["started", "started", "finished"]


def test_closing_leaves_no_thread(
    other_threads, site, live, monkeypatch: pytest.MonkeyPatch, wait_until, encoded
) -> None:
    monkeypatch.setattr("pepper_sim.tablet.http_fetch.READ_TIMEOUT", 60.0)
    image, server = live
    image.put(encoded(RED))
    with socket.create_server(("127.0.0.1", 0)) as silent:
        for url in (server.url, f"http://127.0.0.1:{silent.getsockname()[1]}/", site.url("/nowhere")):
            with Tablet() as tablet:
                tablet.load_url(url)
                tablet.show_webview()
                tablet.show_image(url)
                wait_until(lambda tablet=tablet: tablet.image.peek() is not None)
            assert not tablet.load_url(url)
            assert not [t.name for t in set(threading.enumerate()) - other_threads if t.name.startswith("tablet")]


def test_a_broken_owner_does_not_stop_the_screen(site, encoded) -> None:
    def show(pixels: np.ndarray | None) -> None:
        raise RuntimeError("the owner's mistake")

    site.serve("/", encoded(RED), "image/jpeg")
    with Tablet(show) as tablet:
        tablet.load_url(site.url())
        tablet.show_webview()
        tablet.hide_webview()
        assert any(t.name == "tablet-screen" for t in threading.enumerate())


def test_background_must_be_a_colour(glass) -> None:
    with pytest.raises(ValueError, match="#RRGGBB"):
        glass.tablet.set_background("red")


def test_an_unknown_browser_is_named() -> None:
    with pytest.raises(ValueError, match="not 'lynx'"):
        Tablet(browser="lynx")
