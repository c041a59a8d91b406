"""The tablet on Pepper's chest, as applications see it: a web view, a picture viewer, a screen.

On the robot it is an Android computer of its own with a 1280x800 screen; here the screen is 640x400, the size of its
texture in the simulated world. There is no NAOqi in this file; clients reach it through ALTabletService.
"""

from __future__ import annotations

import logging
import re
import threading
import time
import urllib.parse
from collections.abc import Callable
from typing import Any

import numpy as np

from pepper_sim.body.description import SCREEN_HEIGHT, SCREEN_WIDTH
from pepper_sim.tablet.dialog import covered, draw_dialog
from pepper_sim.tablet.http_fetch import LoadError, RobotFiles, check_url
from pepper_sim.tablet.screen import Layer, Screen
from pepper_sim.tablet.video import NO_VIDEO, Video
from pepper_sim.tablet.web_view import BuiltInBrowser, Events
from telepresence.video.images import LatestImage

log = logging.getLogger(__name__)

_COLOUR = re.compile(r"#([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})")
_WHITE = np.full((SCREEN_HEIGHT, SCREEN_WIDTH, 3), 255, np.uint8)


def _ignore(*_: Any) -> None:
    """The default of every callback."""


class Tablet:
    """A screen that shows the web view, an image, or nothing, whichever was shown last.

    Addresses are really fetched, in the background. The owner may set the callbacks, which are called on the tablet's
    threads: `on_page_started()`, `on_page_finished()`, `on_load_error(code, text, url)` (code of
    android.webkit.WebViewClient), `on_image_loaded()`, `on_video_started()`, `on_video_finished()`,
    `on_js_event(text)`, `on_console(text)`, and `on_answer(confirmed, text)` when somebody has answered a question;
    and `robot_files`, what the robot's own web server has.

    Args:
        show: Receives every new picture of the screen, (400, 640, 3) uint8 RGB, at most 15 per second, always on the
            same thread; None when it turns dark.
        browser: "built-in": finds the page's picture and follows it, without scripts. "chromium": Debian's browser
            without a window, for a page as it is really rendered; needs about 500 MB.
    """

    def __init__(self, show: Callable[[np.ndarray | None], None] = _ignore, browser: str = "built-in") -> None:
        self.url: str | None = None
        self.on_page_started: Callable[[], None] = _ignore
        self.on_page_finished: Callable[[], None] = _ignore
        self.on_load_error: Callable[[int, str, str], None] = _ignore
        self.on_image_loaded: Callable[[], None] = _ignore
        self.on_video_started: Callable[[], None] = _ignore
        self.on_video_finished: Callable[[], None] = _ignore
        self.on_answer: Callable[[bool, str], None] = _ignore
        self.on_js_event: Callable[[str], None] = _ignore
        self.on_console: Callable[[str], None] = _ignore
        self.robot_files: RobotFiles = _no_file
        self._browser = self._make_browser(browser)
        self._image_viewer = BuiltInBrowser(lambda path: self.robot_files(path))
        self._lock = threading.Lock()
        self._page = Layer(_WHITE)
        self._page_view: Any = None
        self._image_view: Any = None
        self._image_layer: Layer | None = None
        self._video: Video | None = None
        self._video_layer: Layer | None = None
        self._dialog: Layer | None = None
        self._cover: Layer | None = None
        self._webview_shown = False
        self._ending: list[Any] = []  # cancelled views that have not ended yet
        self._closed = False
        self._screen = Screen(show)

    @property
    def image(self) -> LatestImage:
        """The picture on the screen, (400, 640, 3) uint8 RGB; black when dark."""
        return self._screen.image

    @property
    def visible(self) -> bool:
        """Whether the web view is on the screen: shown, and not covered by an image or a video."""
        return self._webview_shown and self._image_layer is None and self._video_layer is None

    def load_url(self, url: str) -> bool:
        """Load a page into the web view, shown or not; false if the address is not http or https.

        The callbacks report the result.
        """
        with self._lock:
            if self._closed or not self._acceptable(url):
                return False
            self.url = url
            self._load()
            return True

    def reload(self, bypass_cache: bool = False) -> None:
        """Load the page again. There is no cache that could be bypassed."""
        with self._lock:
            if self.url is not None and not self._closed:
                self._load()

    def execute(self, script: str) -> bool:
        """Run a script in the page; false if there is no page, or the web view is the built-in one."""
        return bool(self._browser.execute(script))

    def show_webview(self) -> None:
        with self._lock:
            self._webview_shown = True
            self._drop_image()
            self._drop_video()
            self._refresh()

    def hide_webview(self) -> None:
        """Hide the web view; the page stays loaded."""
        with self._lock:
            self._webview_shown = False
            self._refresh()

    def show_image(self, url: str) -> bool:
        """Cover the screen with a JPEG, PNG or GIF from this address; false if the address is not http or https."""
        with self._lock:
            if self._closed or not self._acceptable(url):
                return False
            layer = Layer(self._image_layer.content if self._image_layer else None)
            self._drop_image()
            self._drop_video()
            events = Events(_ignore, lambda: self.on_image_loaded(), lambda *error: self.on_load_error(*error))
            self._image_layer = layer
            if urllib.parse.urlsplit(url).path.lower().endswith(".gif"):
                moving = Events(lambda: self.on_image_loaded(), _ignore, lambda *error: self.on_load_error(*error))
                self._image_view = Video(url, layer, moving, self._image_viewer.fetcher(), repeated=True)
            else:
                self._image_view = self._image_viewer.open(url, layer, events)
            self._refresh()
            return True

    def hide_image(self) -> None:
        with self._lock:
            self._drop_image()
            self._refresh()

    def pause_image(self, paused: bool) -> None:
        """Let an animated picture stand still, or go on."""
        view = self._image_view
        if isinstance(view, Video):
            view.pause(paused)

    # --- videos ------------------------------------------------------------------------------------------------------

    def show_video(self, url: str) -> bool:
        """Cover the screen with a video from this address; false if the address is not http or https."""
        with self._lock:
            if self._closed or not self._acceptable(url):
                return False
            self._drop_video()
            layer = Layer()
            events = Events(lambda: self.on_video_started(), lambda: self._end_video(layer), self._report_video)
            self._video_layer = layer
            self._video = Video(url, layer, events, self._image_viewer.fetcher())
            self._refresh()
            return True

    def pause_video(self, paused: bool) -> bool:
        """Let the video stand still, or go on; false if there is none."""
        video = self._video
        if video is not None:
            video.pause(paused)
        return video is not None

    def stop_video(self) -> bool:
        """End the video; false if there is none."""
        with self._lock:
            playing = self._video is not None
            self._drop_video()
            self._refresh()
            return playing

    @property
    def video_length(self) -> int:
        """How long the video is [ms]; -1 if there is none."""
        return self._video.length if self._video is not None else NO_VIDEO

    @property
    def video_position(self) -> int:
        """How much of the video has been shown [ms]; -1 if there is none."""
        return self._video.position if self._video is not None else NO_VIDEO

    # --- questions, covers, the screen -------------------------------------------------------------------------------

    def ask(self, title: str, text: str, confirm: str, cancel: str) -> None:
        """Show a question with a line to type into, over everything else, until `answer` or `hide_dialog`."""
        with self._lock:
            self._dialog = Layer(draw_dialog(title, text, confirm, cancel))
            self._refresh()

    def answer(self, confirmed: bool, text: str = "") -> None:
        """Answer the question as a person would: type a text and touch a button. Nothing happens if there is none."""
        with self._lock:
            asked, self._dialog = self._dialog, None
            self._refresh()
        if asked is not None:
            self.on_answer(confirmed, text)

    def hide_dialog(self) -> None:
        """Close the question without an answer."""
        with self._lock:
            self._dialog = None
            self._refresh()

    def cover(self, colour: str, opacity: float) -> None:
        """Cover everything with a colour, "#RRGGBB"; 1 hides it.

        Raises:
            ValueError: The text is not such a colour.
        """
        picture = self.image.peek()
        below = np.zeros_like(_WHITE) if picture is None else picture.content
        mixed = covered(below, _colour(colour), opacity)
        with self._lock:
            self._cover = Layer(mixed)
            self._refresh()

    def uncover(self) -> None:
        """Take the cover away."""
        with self._lock:
            self._cover = None
            self._refresh()

    def switch(self, on: bool) -> None:
        """Switch the screen on or off; what it shows stays."""
        self._screen.switch(on)

    def set_brightness(self, brightness: float) -> None:
        """Set how bright the screen is, 0 to 1."""
        self._screen.set_brightness(brightness)

    def set_background(self, colour: str) -> None:
        """Set the colour around pictures, as "#RRGGBB".

        Raises:
            ValueError: The text is not such a colour.
        """
        self._screen.set_background(_colour(colour))

    def close(self) -> None:
        """Turn the screen off and end every thread and connection."""
        with self._lock:
            self._closed = True
            self._drop_image()
            self._drop_video()
            self._end(self._page_view)
            self._page_view = None
            ending, self._ending = self._ending, []
        deadline = time.monotonic() + 10.0
        for view in ending:
            if not view.join(max(0.0, deadline - time.monotonic())):
                log.warning("a page of the tablet is still waiting for a name server")
        self._browser.close()
        self._screen.close()

    def __enter__(self) -> Tablet:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _acceptable(self, url: str) -> bool:
        try:
            check_url(url)
        except LoadError as error:
            log.warning("the tablet does not load %.200r: %s", url, error)
            return False
        return True

    def _load(self) -> None:
        self._end(self._page_view)
        page = Layer(self._page.content)  # the previous page stays until this one has something to show
        events = Events(
            lambda: self.on_page_started(), lambda: self.on_page_finished(), lambda *error: self.on_load_error(*error)
        )
        self._page = page
        if self.visible:
            self._refresh()
        self._page_view = self._browser.open(self.url, page, events)

    def _make_browser(self, name: str) -> Any:
        if name == "built-in":
            return BuiltInBrowser(lambda path: self.robot_files(path))
        if name == "chromium":
            from pepper_sim.tablet.chromium import Chromium

            return Chromium(
                lambda path: self.robot_files(path),
                lambda text: self.on_js_event(text),
                lambda text: self.on_console(text),
            )
        raise ValueError(f'the tablet\'s browser is "built-in" or "chromium", not {name!r}')

    def _refresh(self) -> None:
        """Show the layer that is on top."""
        page = self._page if self._webview_shown else None
        layers = (self._cover, self._dialog, self._video_layer, self._image_layer, page)
        self._screen.set_layer(next((layer for layer in layers if layer is not None), None))

    def _end_video(self, layer: Layer) -> None:
        with self._lock:
            if self._video_layer is layer:
                self._video = self._video_layer = None
                self._refresh()
        self.on_video_finished()

    def _report_video(self, code: int, text: str, url: str) -> None:
        log.warning("the tablet does not play %.200r: %s", url, text)
        self.stop_video()

    def _drop_video(self) -> None:
        self._end(self._video)
        self._video = self._video_layer = None

    def _drop_image(self) -> None:
        self._end(self._image_view)
        self._image_view = self._image_layer = None

    def _end(self, view: Any) -> None:
        if view is not None:
            view.cancel()
            self._ending = [old for old in [*self._ending, view] if not old.join(0)]


def _no_file(path: str) -> None:
    """A robot without a web server."""


def _colour(text: str) -> tuple[int, int, int]:
    match = _COLOUR.fullmatch(text)
    if match is None:
        raise ValueError(f"a colour must be written as #RRGGBB, got {text!r}")
    red, green, blue = (int(part, 16) for part in match.groups())
    return red, green, blue
