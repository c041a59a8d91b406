"""The page in Chromium: that it looks as it should, and that its watchdog brings the picture back."""

from __future__ import annotations

import base64
import contextlib
import itertools
import socket
import threading
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from telepresence_1.camera import Camera

from pepper_sim.tablet.devtools import BrowserError, DevTools

pytestmark = pytest.mark.browser

NEWER = tuple(
    f"{owner}.{name}"
    for owner, names in {
        "window": "URLSearchParams Proxy Reflect IntersectionObserver ResizeObserver AbortController queueMicrotask "
        "requestIdleCallback structuredClone",
        "Object": "assign values entries",
        "Array": "from of",
        "Array.prototype": "includes flat at",
        "String.prototype": "padStart padEnd trimStart replaceAll",
        "Promise.prototype": "finally",
        "Element.prototype": "append prepend",
        "NodeList.prototype": "forEach",
    }.items()
    for name in names.split()
)
"""What came with Chrome 45 or later."""
RED, GREEN, BLUE = (200, 0, 0), (0, 200, 0), (0, 0, 200)


class Browser:
    def __init__(self) -> None:
        self.errors: list[str] = []
        """What the page complained about since it was opened."""
        self.tools = DevTools(self._note)
        for domain in ("Page", "Runtime", "Log"):
            self.tools.call(f"{domain}.enable")
        self._before: list[str] = []
        self.start_afresh()

    def start_afresh(self) -> None:
        """Show nothing, on the usual screen, as a browser that knows all features."""
        self.tools.call("Page.navigate", url="about:blank")
        for script in self._before:
            self.tools.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
        self._before.clear()
        self.resize(1280, 800)
        self.errors.clear()

    def resize(self, width: int, height: int) -> None:
        self.tools.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

    def _note(self, method: str, params: dict) -> None:
        wrong = (
            method == "Runtime.exceptionThrown"
            or (method == "Runtime.consoleAPICalled" and params["type"] == "error")
            or (method == "Log.entryAdded" and params["entry"]["level"] == "error")
        )
        if wrong:
            self.errors.append(str(params))

    def forget(self, features: tuple[str, ...]) -> None:
        """Remove these objects and functions from the next page on."""
        script = "".join(f"delete {feature};" for feature in features)
        added = self.tools.call("Page.addScriptToEvaluateOnNewDocument", source=script)
        self._before.append(added["identifier"])

    def open(self, url: str) -> None:
        self.errors.clear()
        self.tools.call("Page.navigate", url=url)

    def evaluate(self, expression: str) -> object:
        return self.tools.call("Runtime.evaluate", expression=expression)["result"].get("value")

    def screenshot(self) -> np.ndarray:
        """(height, width, 3) RGB."""
        data = base64.b64decode(self.tools.call("Page.captureScreenshot", format="png")["data"])
        return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1]

    def shows(self, colour: tuple[int, int, int]) -> bool:
        """Whether the upper half, where no words are, shows this colour."""
        try:
            picture = self.screenshot()
        except BrowserError:
            return False  # between two pages
        height, width = picture.shape[:2]
        return all(
            abs(picture[y, x].astype(int) - colour).max() < 15
            for y in (3, height // 2)
            for x in (3, width // 2, width - 4)
        )


def shows_new(browser: Browser, page: SimpleNamespace, picture: bytes, colour: tuple[int, int, int]) -> bool:
    """Whether the page shows this picture, of a camera that goes on: one that stops is dimmed after three seconds."""
    page.image.put(picture)
    return browser.shows(colour)


class Wire:
    """A TCP relay to the server that can break the streams and nothing else, as a forgetful router does."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        self.streams = 0
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._frozen: set[socket.socket] = set()
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> Wire:
        return self

    def __exit__(self, *_: object) -> None:
        self._listening.close()
        for pair in self._pairs:
            for end in pair:
                end.close()

    def cut(self) -> None:
        """End the streams that are open now."""
        for end in itertools.chain(*self._pairs):
            with contextlib.suppress(OSError):  # over already
                end.shutdown(socket.SHUT_RDWR)

    def freeze(self) -> None:
        """Forward nothing of the streams that are open now, and report nothing."""
        self._frozen.update(server for _, server in self._pairs)

    def _accept(self) -> None:
        while True:
            try:
                browser, _ = self._listening.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(browser,), daemon=True).start()

    def _serve(self, browser: socket.socket) -> None:
        server = socket.create_connection(("127.0.0.1", self._target))
        threading.Thread(target=self._back, args=(server, browser), daemon=True).start()
        try:
            while data := browser.recv(65536):
                if b"GET /video_feed" in data:
                    self.streams += 1
                    self._pairs.append((browser, server))
                server.sendall(data)
        except OSError:
            pass
        finally:
            server.close()

    def _back(self, server: socket.socket, browser: socket.socket) -> None:
        try:
            while server not in self._frozen and (data := server.recv(65536)):
                browser.sendall(data)
        except OSError:
            pass
        finally:
            if server not in self._frozen:
                browser.close()


def noise() -> bytes:
    """A picture that JPEG cannot make small."""
    pixels = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
    return cv2.imencode(".jpg", pixels)[1].tobytes()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    browser = Browser()
    yield browser
    browser.tools.close()


@pytest.fixture
def browser(chromium: Browser) -> Browser:
    chromium.start_afresh()
    return chromium


@pytest.mark.parametrize("size", [(1280, 800), (640, 400)])
def test_the_picture_fills_the_screen_and_the_words_are_on_it(
    size: tuple[int, int], browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page(name="Anna Petersen")
    page.image.put(jpeg(BLUE))
    browser.resize(*size)
    browser.open(page.server.url)
    wait_until(lambda: shows_new(browser, page, jpeg(BLUE), BLUE), "the picture is painted")
    picture = browser.screenshot()
    assert picture.shape == (size[1], size[0], 3)
    foot = picture[int(size[1] * 0.8) :, : size[0] // 2]
    assert (foot.min(axis=2) > 200).mean() > 0.01, "no white letters at the foot"
    wait_until(lambda: shows_new(browser, page, jpeg(RED), RED), "the next picture is painted")


@pytest.mark.parametrize("missing", [(), NEWER], ids=["current", "as old as the tablet's web view"])
def test_a_live_camera_is_seen_moving_and_the_page_complains_about_nothing(
    missing: tuple[str, ...], browser: Browser, open_page: Callable, wait_until: Callable
) -> None:
    """That the old web view can read the page's script at all is tested in test_page.py."""
    browser.forget(missing)
    with Camera("test") as camera:
        page = open_page(image=camera.image)
        browser.open(page.server.url)
        wait_until(lambda: browser.evaluate("document.getElementById('picture').naturalWidth") == 640, "a picture")
        wait_until(lambda: browser.screenshot().std() > 40, "the test card is painted")
        first = browser.screenshot()
        wait_until(lambda: (browser.screenshot()[:500] != first[:500]).any(), "the picture moves")
        assert browser.evaluate("document.body.className") == "live"
        for feature in missing:
            assert browser.evaluate(f"typeof {feature}") == "undefined", "the browser still has it"
        assert not browser.errors


def test_the_page_says_when_the_camera_is_lost(
    browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page()
    page.image.put(jpeg(BLUE))
    browser.open(page.server.url)
    page.state[:] = ["lost", "There is no camera."]
    wait_until(lambda: browser.evaluate("document.body.className") == "lost", "the page knows")
    assert "camera" in str(browser.evaluate("document.getElementById('words').textContent"))


def test_the_page_names_who_looks_through_the_robot(
    browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    looking: list[str] = []
    page = open_page(looking=lambda: looking)
    page.image.put(jpeg(BLUE))
    browser.open(page.server.url)

    def shown() -> object:
        return browser.evaluate("document.getElementById('looking').innerText")

    for names, words in (
        (["<b>anna"], "<b>anna is looking through my eyes"),
        (["anna", "ben"], "anna and ben are looking through my eyes"),
        (["anna", "ben", "eve", "ida", "will"], "anna, ben, eve and 2 others are looking through my eyes"),
    ):
        looking[:] = names
        wait_until(lambda words=words: shown() == words, words)
    looking.clear()
    wait_until(lambda: browser.evaluate("document.getElementById('looking').offsetHeight") == 0, "nobody looks")


def test_a_server_that_dies_is_missed_and_found_again(
    browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page()
    page.image.put(jpeg(BLUE))
    browser.open(page.server.url)
    wait_until(lambda: shows_new(browser, page, jpeg(BLUE), BLUE), "the picture is painted")
    page.server.close()
    wait_until(lambda: browser.evaluate("document.body.className") == "waiting", "the page notices")
    again = open_page(port=page.server.port)
    wait_until(lambda: shows_new(browser, again, jpeg(GREEN), GREEN), "the picture is back")
    assert browser.evaluate("document.body.className") == "live"


@pytest.mark.parametrize("fault", ["cut", "freeze"])
def test_a_stream_that_dies_alone_is_opened_again(
    fault: str, browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page(timeout=60.0)  # the server itself would notice in the end
    page.image.put(jpeg(BLUE))
    with Wire(page.server.port) as wire:
        browser.open(f"http://127.0.0.1:{wire.port}/")
        wait_until(lambda: shows_new(browser, page, jpeg(BLUE), BLUE), "the picture is painted")
        before = wire.streams
        getattr(wire, fault)()

        def moves_on() -> bool:
            page.image.put(noise())  # more than fits into the sockets of a frozen stream
            return wire.streams > before

        wait_until(moves_on, "the page opens another stream")
        wait_until(lambda: shows_new(browser, page, jpeg(RED), RED), "the picture is back")


def test_single_pictures_where_streams_do_not_work(
    browser: Browser, open_page: Callable, jpeg: Callable, wait_until: Callable
) -> None:
    page = open_page(max_viewers=0)
    page.image.put(jpeg(GREEN))
    browser.open(page.server.url)
    wait_until(lambda: shows_new(browser, page, jpeg(GREEN), GREEN), "the page asks for single pictures")
    wait_until(lambda: shows_new(browser, page, jpeg(RED), RED), "the next picture")
