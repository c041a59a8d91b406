"""The tablet's built-in web view: fetches a page, finds its picture and follows it; no scripts, no style sheets.

That is all a telepresence page needs (one <img> with a JPEG, a PNG, or a multipart/x-mixed-replace stream), for a
twentieth of a browser's processor time. A dropped stream is requested again; on the real tablet the page's own script
does that.
"""

from __future__ import annotations

import email.message
import http.cookiejar
import logging
import threading
import urllib.parse
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pepper_sim.tablet.http_fetch import UNKNOWN, Cancelled, Fetcher, LoadError, RobotFiles
from pepper_sim.tablet.multipart import MalformedStream, MultipartParser
from pepper_sim.tablet.screen import Layer, decode
from pepper_sim.tablet.web_page import PageReader, draw_error_page, draw_text_page

log = logging.getLogger(__name__)

PAGE_LIMIT = 1_000_000  # bytes of a page that are read
IMAGE_LIMIT = 8_000_000  # bytes of one picture
LOAD_TIMEOUT = 20.0  # seconds for a page or a still picture
RETRY_DELAYS = (0.5, 1.0, 2.0, 4.0, 5.0)  # seconds before each attempt to reopen a dropped stream; the last repeats


@dataclass(frozen=True)
class Events:
    """Callbacks of a view, called on the view's own thread."""

    started: Callable[[], None]
    finished: Callable[[], None]
    failed: Callable[[int, str, str], None]  # code of android.webkit.WebViewClient, text, address


class BuiltInBrowser:
    """Opens views that share their cookies; `robot_files` as for `Fetcher`."""

    def __init__(self, robot_files: RobotFiles | None = None) -> None:
        self._cookies = http.cookiejar.CookieJar()
        self._robot_files = robot_files

    def open(self, url: str, layer: Layer, events: Events) -> WebView:
        return WebView(url, layer, events, self.fetcher())

    def execute(self, script: str) -> bool:
        """Run no script: there is no engine."""
        return False

    def fetcher(self) -> Fetcher:
        """Return what makes the requests of one page."""
        return Fetcher(self._cookies, self._robot_files)

    def close(self) -> None:
        """Do nothing: views are closed one by one by their owner, and nothing else is open."""


class WebView:
    """One page that is loaded and followed on a thread of its own, and shown in `layer`."""

    def __init__(self, url: str, layer: Layer, events: Events, fetcher: Fetcher) -> None:
        self._url = url
        self._layer = layer
        self._events = events
        self._fetcher = fetcher
        self._stop = threading.Event()
        self._finished = False
        self._shown = False
        self._failures = 0
        self._thread = threading.Thread(target=self._run, name="tablet-page", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Stop at once, without waiting for the thread."""
        self._stop.set()
        self._fetcher.cancel()

    def join(self, timeout: float) -> bool:
        """Wait at most `timeout` seconds for the thread; whether it has ended."""
        if self._thread is not threading.current_thread():  # a callback may close the tablet
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._events.started()
            self._load()
            self._finish()
        except Cancelled:
            pass
        except LoadError as error:
            self._layer.put(draw_error_page(self._url, error.text))
            self._events.failed(error.code, error.text, self._url)
        except Exception:  # top of a thread that reads foreign pages and calls the owner's callbacks
            log.exception("the tablet's view of %s failed", self._url)

    def _finish(self) -> None:
        if not self._finished and not self._stop.is_set():
            self._finished = True
            self._events.finished()

    def _load(self) -> None:
        response = self._fetcher.get(self._url)
        image: str | None = self._url
        words = draw_text_page(self._url, ["This picture cannot be shown."])
        if not response.headers.get_content_type().startswith(("image/", "multipart/")):
            with response:
                page = self._read_page(response)
            response, image = None, page.image
            words = draw_text_page(page.title, page.lines)
        if image is None:
            self._layer.put(words)
        else:
            self._show_image(image, words, response)

    def _read_page(self, response: Any) -> PageReader:
        body = self._fetcher.read_all(response, PAGE_LIMIT, LOAD_TIMEOUT)
        charset = response.headers.get_content_charset("utf-8")
        try:
            text = body.decode(charset, "replace")
        except LookupError:
            text = body.decode("utf-8", "replace")
        kind = response.headers.get_content_type()
        reader = PageReader(response.url)
        if kind in ("text/html", "application/xhtml+xml"):
            reader.feed(text + "<br>")  # a tag flushes the last words; close() is slow on hostile pages
        elif kind.startswith("text/") or kind == "application/json":
            reader.handle_data(text)
        else:
            raise LoadError(UNKNOWN, f"net::ERR_ABORTED: the web view shows no {kind}")
        return reader

    def _show_image(self, url: str, words: np.ndarray, response: Any) -> None:
        """Show a still picture, or follow a stream until cancelled; show `words` as long as there is neither.

        `response` is the first response, None to request it.
        """
        while True:
            try:
                with response or self._fetcher.get(url) as current:
                    reason = self._show_response(current)
                    if reason is None:
                        break
            except (LoadError, MalformedStream) as error:
                reason = str(error)
            response = None
            if not self._shown:
                self._layer.put(words)
            self._finish()
            log.debug("the tablet has no picture from %s: %s", url, reason)
            self._wait_for_retry(url)
        if not self._shown:
            self._layer.put(words)

    def _show_response(self, response: Any) -> str | None:
        """Show a response; return None when done, otherwise the reason for another attempt."""
        if response.headers.get_content_type() == "multipart/x-mixed-replace":
            self._follow(response)
            return "the stream has ended"
        if not self._show_still(response) and (self._shown or response.status >= 500):
            return f"HTTP status {response.status}"
        return None

    def _show_still(self, response: Any) -> bool:
        data = self._fetcher.read_all(response, IMAGE_LIMIT, LOAD_TIMEOUT)
        try:
            decode(data)
        except ValueError as error:
            log.debug("no picture at %s: %s", response.url, error)
            return False
        self._layer.put(data)
        self._shown = True
        return True

    def _follow(self, response: Any) -> None:
        boundary = email.message.Message.get_param(response.headers, "boundary") or ""
        parser = MultipartParser(str(boundary), IMAGE_LIMIT)
        while data := self._fetcher.read(response, 262144):
            bodies = [body for body in parser.feed(data) if body]
            if bodies:
                self._failures = 0
                self._shown = True
                self._layer.put(bodies[-1])
                self._finish()

    def _wait_for_retry(self, url: str) -> None:
        delay = RETRY_DELAYS[min(self._failures, len(RETRY_DELAYS) - 1)]
        self._failures += 1
        if self._failures > 2:
            self._layer.set_note(f"No picture from {urllib.parse.urlsplit(url).netloc}, trying again")
        if self._stop.wait(delay):
            raise Cancelled
