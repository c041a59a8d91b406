"""The tablet's web view with Debian's Chromium: scripts and style sheets included, at the tablet's own 1280x800.

It needs about half a processor core and 500 MB while it shows video; the built-in view needs a twentieth of a core.
The browser starts with the first page and stays for all later ones.
"""

from __future__ import annotations

import base64
import logging
import mimetypes
import threading
import time
import urllib.parse
from collections.abc import Callable
from typing import Any

from pepper_sim.body.description import SCREEN_HEIGHT, SCREEN_WIDTH, TABLET_HEIGHT, TABLET_WIDTH
from pepper_sim.tablet.devtools import BrowserError, DevTools
from pepper_sim.tablet.http_fetch import (
    BAD_URL,
    CONNECT,
    HOST_LOOKUP,
    IO,
    REDIRECT_LOOP,
    ROBOT_HOST,
    TIMEOUT,
    UNKNOWN,
    USER_AGENT,
    RobotFiles,
)
from pepper_sim.tablet.screen import PERIOD, Layer
from pepper_sim.tablet.web_page import draw_error_page
from pepper_sim.tablet.web_view import Events

log = logging.getLogger(__name__)

_CODES = {
    "net::ERR_NAME_NOT_RESOLVED": HOST_LOOKUP,
    "net::ERR_CONNECTION_REFUSED": CONNECT,
    "net::ERR_ADDRESS_UNREACHABLE": CONNECT,
    "net::ERR_CONNECTION_RESET": IO,
    "net::ERR_EMPTY_RESPONSE": IO,
    "net::ERR_TIMED_OUT": TIMEOUT,
    "net::ERR_CONNECTION_TIMED_OUT": TIMEOUT,
    "net::ERR_TOO_MANY_REDIRECTS": REDIRECT_LOOP,
    "net::ERR_INVALID_URL": BAD_URL,
}


_BINDING = "raiseRobotEvent"
_PAGE_OBJECTS = f"window.ALTabletBinding = {{raiseEvent: text => window.{_BINDING}(String(text))}};"
"""What a page finds on Pepper's tablet (NAOqi 2.8 documentation, ALTabletService, onJSEvent)."""
_LONGEST_TEXT = 100_000
BEHIND_PHYSICS = 10
"""Niceness: on a busy machine the tablet may be late, physics and cameras may not."""


class Chromium:
    """Opens pages in one browser, one at a time.

    Args:
        robot_files: What the robot's own web server has.
        on_event: Called with each text that a page raises with `ALTabletBinding.raiseEvent`.
        on_console: Called with each line that a page writes on its console.
    """

    def __init__(
        self,
        robot_files: RobotFiles = lambda path: None,
        on_event: Callable[[str], None] = lambda text: None,
        on_console: Callable[[str], None] = lambda text: None,
    ) -> None:
        self._robot_files, self._on_event, self._on_console = robot_files, on_event, on_console
        self._starting = threading.Lock()  # held for up to a minute: nobody who opens a page may wait for it
        self._lock = threading.Lock()
        self._tools: DevTools | None = None
        self._view: ChromiumView | None = None
        self._answered = 0.0
        self._closing = threading.Event()  # also ends the pauses between pictures

    def open(self, url: str, layer: Layer, events: Events) -> ChromiumView:
        view = ChromiumView(self, url, layer, events)
        with self._lock:
            self._view = view
        view.start()
        return view

    def execute(self, script: str) -> bool:
        """Run a script in the page; false if there is none."""
        tools = self._tools
        if tools is not None and self._view is not None:
            tools.post("Runtime.evaluate", expression=script, userGesture=True)
            return True
        return False

    def close(self) -> None:
        self._closing.set()
        with self._starting, self._lock:
            tools, self._tools = self._tools, None
            self._view = None
        if tools is not None:
            tools.close()

    def tools(self, view: ChromiumView) -> DevTools | None:
        """Return the running browser, started if necessary; None if `view` is no longer the current one.

        Raises:
            BrowserError: It does not start.
        """
        with self._starting:
            with self._lock:
                if self._view is not view or self._closing.is_set():
                    return None
                tools = self._tools
                if tools is not None and tools.alive:
                    return tools
                self._tools = None
            if tools is not None:
                tools.close()
            started = self._start()
            with self._lock:
                self._tools = started
                return started if self._view is view else None

    def _start(self) -> DevTools:
        tools = DevTools(self._handle, niceness=BEHIND_PHYSICS)
        try:
            self._prepare(tools)
        except BrowserError:
            tools.close()
            raise
        return tools

    def _prepare(self, tools: DevTools) -> None:
        size = {"width": TABLET_WIDTH, "height": TABLET_HEIGHT}
        tools.call("Emulation.setDeviceMetricsOverride", **size, deviceScaleFactor=1, mobile=False)
        tools.call("Emulation.setUserAgentOverride", userAgent=USER_AGENT)
        tools.call("Page.enable")
        tools.call("Runtime.enable")
        tools.call("Runtime.addBinding", name=_BINDING)
        tools.call("Page.addScriptToEvaluateOnNewDocument", source=_PAGE_OBJECTS)
        tools.call("Fetch.enable", patterns=[{"urlPattern": f"http://{ROBOT_HOST}/*"}])
        tools.call("Page.startScreencast", format="jpeg", quality=80, maxWidth=SCREEN_WIDTH, maxHeight=SCREEN_HEIGHT)

    def _handle(self, method: str, params: dict[str, Any]) -> None:
        """Handle an event of the browser, on the reader's thread."""
        view, tools = self._view, self._tools
        if method == "Page.screencastFrame":
            if view is not None:
                view.show(base64.b64decode(params["data"]))
            # Chromium sends the next picture only after this answer: delaying it limits the rate.
            self._closing.wait(max(0.0, self._answered + PERIOD - time.monotonic()))
            self._answered = time.monotonic()
            if tools is not None:
                tools.post("Page.screencastFrameAck", sessionId=params["sessionId"])
        elif method == "Page.loadEventFired" and view is not None:
            view.loaded()
        elif method == "Runtime.bindingCalled" and params["name"] == _BINDING:
            self._on_event(params["payload"][:_LONGEST_TEXT])
        elif method == "Runtime.consoleAPICalled":
            words = (str(word.get("value", word.get("description", ""))) for word in params["args"])
            self._on_console(" ".join(words)[:_LONGEST_TEXT])
        elif method == "Fetch.requestPaused" and tools is not None:
            self._answer_from_disk(tools, params)

    def _answer_from_disk(self, tools: DevTools, params: dict[str, Any]) -> None:
        file = self._robot_files(urllib.parse.unquote(urllib.parse.urlsplit(params["request"]["url"]).path))
        kind = (mimetypes.guess_type(file.name)[0] if file is not None else None) or "text/html"
        body = file.read_bytes() if file is not None else b"<h1>404 Not Found</h1>"
        tools.post(
            "Fetch.fulfillRequest",
            requestId=params["requestId"],
            responseCode=200 if file is not None else 404,
            responseHeaders=[{"name": "Content-Type", "value": kind}],
            body=base64.b64encode(body).decode(),
        )


class ChromiumView:
    """One page in the browser, shown in `layer` until cancelled."""

    def __init__(self, browser: Chromium, url: str, layer: Layer, events: Events) -> None:
        self._browser = browser
        self._url = url
        self._layer = layer
        self._events = events
        self._cancelled = False
        self._committed = False
        self._finished = False
        self._thread = threading.Thread(target=self._run, name="tablet-page", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def cancel(self) -> None:
        """Stop showing this page; the browser keeps it until the next one."""
        self._cancelled = True

    def join(self, timeout: float) -> bool:
        if self._thread is not threading.current_thread():
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def show(self, jpeg: bytes) -> None:
        if self._committed and not self._cancelled:
            self._layer.put(jpeg)

    def loaded(self) -> None:
        if self._committed and not self._finished and not self._cancelled:
            self._finished = True
            self._events.finished()

    def _run(self) -> None:
        try:
            self._events.started()
            tools = self._browser.tools(self)
            if tools is None or self._cancelled:
                return
            self._committed = True  # the load event may come before the reply
            error = tools.call("Page.navigate", url=self._url).get("errorText")
            if error:
                self._committed = False
                self._fail(_CODES.get(error, UNKNOWN), error)
        except BrowserError as error:
            log.error("the tablet's browser: %s", error)
            self._fail(UNKNOWN, str(error))
        except Exception:  # top of a thread that calls the owner's callbacks
            log.exception("the tablet's view of %s failed", self._url)

    def _fail(self, code: int, text: str) -> None:
        if not self._cancelled:
            self._layer.put(draw_error_page(self._url, text))
            self._events.failed(code, text, self._url)
