"""Keeps a page on the robot's tablet: shows it, shows it again when somebody hides it, and takes it away at the end.

Wire (NAOqi 2.8 documentation, ALTabletService): `getWifiStatus()` -> "IDLE", "SCANNING", "DISCONNECTED" or "CONNECTED";
`loadUrl(url)` -> bool, with the signal `onLoadPageError(code, text, url)` when it fails later; `showWebview()` -> bool;
`hideWebview()` -> bool; `getOnTouchScaleFactor()` -> "the touch scale factor of current view displayed. Default is 1.0
for all views except for the browser view which is 1.34": nothing else says whether the page is on the screen. A hidden
page stays loaded, and any program's showWebview brings it back: so another one is loaded in its place. The tablet is a
computer of its own: it fetches the page itself, over its own Wi-Fi, so the address must be one that it can reach, never
"localhost".
"""

from __future__ import annotations

import logging
import threading
import time
import urllib.parse
from typing import Any

from naoqi_driver.connection import CallRefused, Connection, RobotError
from naoqi_driver.replies import kind, number, text

from telepresence.security.outside_text import clean
from telepresence_1.retry import Retry
from telepresence_1.robot_focus import ACTIVITY, RobotFocus

log = logging.getLogger(__name__)

LOAD_TIMEOUT = 5.0
"""Seconds that the tablet may take to answer; a sleeping one needs a while."""
HIDE_TIMEOUT = 0.5
"""Seconds allowed for taking the page away: a program that ends does not wait for a robot that is gone."""
CHECK_PERIOD = 1.0
"""Seconds between two looks at what the tablet shows."""
CONNECT_PERIOD = 0.2
"""Seconds between two looks at a link that is not there."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 10.0
"""Seconds between two attempts to load the page or to bring it back."""
OTHER_VIEWS_SCALE = 1.0
"""What getOnTouchScaleFactor answers while the web view is not on the screen."""
BLANK = "/blank"
"""Path of what is loaded in place of a page that was taken away, on the same server: an empty page where that is ours;
an error's does as well."""
HIDDEN = "something else is on the screen"


class TabletLink:
    """Keeps `url` on the tablet between `start` and `close`, while it is `wanted`, and takes it away otherwise.

    Args:
        connection: The link to the robot; started and closed by its owner.
        url: Of the page, as the tablet must ask for it.
        wanted: Whether to show the page from the start, see `show`.
        activity: Which of the robot's activities to keep in focus meanwhile; "none" for none.
    """

    def __init__(self, connection: Connection, url: str, wanted: bool = True, activity: str = ACTIVITY) -> None:
        self.url = url
        self.wanted = wanted
        self.shown_since: float | None = None
        """Monotonic time [s] since when the tablet says that it shows the page; None when it does not."""
        self.problem = "not connected yet"
        """Why the page is not shown."""
        self.may_be_there = False
        """Whether the tablet was asked for the page and has not confirmed that it is gone, on whatever connection."""
        self.focus = RobotFocus(connection, activity)
        self._connection = connection
        self._loaded_on = 0  # number of the connection on which it was loaded
        self._scale_differs = False  # whether this tablet's touch scale differs from view to view
        self._watched_on = 0  # number of the connection on which its signal was subscribed to
        self._load_error = ""
        self._reload = False
        self._loading = Retry(FIRST_PAUSE, LONGEST_PAUSE)
        self._showing = Retry(FIRST_PAUSE, LONGEST_PAUSE)
        self._hiding = Retry(FIRST_PAUSE, LONGEST_PAUSE)
        self._stop = threading.Event()
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tablet-link", daemon=True)

    def start(self) -> TabletLink:
        self._thread.start()
        return self

    def show(self, wanted: bool) -> None:
        """Show the page from now on, or take it away and give the focus back; returns at once."""
        self.wanted = wanted
        self._wake.set()

    def reload(self) -> None:
        """Load the page anew, for a tablet that does not ask for the picture in it; returns at once."""
        self._reload = True

    def close(self, leave: bool = False) -> None:
        """Take the page away if it is shown, unless told to `leave` it; at most about two seconds."""
        self._stop.set()
        self._wake.set()
        if self._thread.ident is not None:
            self._thread.join(timeout=1.0)  # it could show the page again after we hid it
        if not leave and self._connection.connected:
            self._take_away()

    def _run(self) -> None:
        while not self._stop.is_set():
            period = CHECK_PERIOD
            try:
                if self._connection.connected:
                    self._keep()
                else:
                    self._not_shown(self._connection.problem or "not connected", quiet=True)
                    period = CONNECT_PERIOD
            except RobotError as error:
                self._not_shown(str(error))
                period = FIRST_PAUSE
            except Exception:  # top of the thread: it goes on and tries again
                log.exception("showing the page failed")
            self._wake.wait(period)
            self._wake.clear()

    def _keep(self) -> None:
        now = time.monotonic()
        if not self.wanted:
            if not self.may_be_there or self._hiding.due(now):
                self._take_away()
            self._not_shown("switched off", quiet=True)
            return
        self.focus.keep()  # first: the robot clears its tablet when it changes the activity
        if self._stop.is_set():
            return
        if self._loaded_on != self._connection.connections:
            if self._loading.due(now):
                self._load()
        elif self._load_error:
            self._not_shown(f"the tablet cannot load it: {self._load_error}")
            if self._loading.due(now):
                self._load()
        elif self._reload and self._loading.due(now):
            self._load()
        else:
            self._keep_displayed(now)

    def _keep_displayed(self, now: float) -> None:
        displayed = self._displayed()
        if displayed:
            self._is_shown()
            return
        if displayed is False and self.shown_since is not None:
            self._not_shown(HIDDEN)
        if self._showing.due(now):  # also now and then for a tablet that does not say what it shows
            self._show()

    def _load(self) -> None:
        number = self._connection.connections
        if self._watched_on != number:
            self._watch_errors()
            self._watched_on = number
        wifi = text(self._ask("getWifiStatus"), "getWifiStatus", 40)
        if wifi != "CONNECTED":
            log.warning("the tablet's own Wi-Fi is %s: it may not reach %s", wifi, public(self.url))
        if self._stop.is_set():
            return
        self._load_error = ""
        self.may_be_there = True
        self._demand("loadUrl", with_changing_query(self.url))
        self._reload = False
        if self._stop.is_set():
            return
        self._demand("showWebview")  # it counts as shown at the next look, when it was not refused meanwhile
        self._loaded_on = number

    def _watch_errors(self) -> None:
        def report(*error: Any) -> None:  # code, text, address; not the address: it may hold the key
            code, words = error[:2] if len(error) >= 2 else (None, None)
            self._load_error = f"{clean(words, 80) if isinstance(words, str) else kind(words)} ({kind(code)})"
            self._wake.set()

        try:
            self._connection.subscribe("ALTabletService", "onLoadPageError", report)
        except CallRefused as error:
            log.debug("the tablet does not say when it cannot load a page: %s", error)

    def _show(self) -> None:
        if self._stop.is_set() or not self.wanted:
            return
        self._demand("showWebview")
        if self._displayed() is False:
            self._not_shown(HIDDEN)
        else:
            self._is_shown()

    def _is_shown(self) -> None:
        if self.shown_since is None:
            self.shown_since = time.monotonic()
            self.problem = ""
            log.info("the tablet shows %s", public(self.url))

    def _displayed(self, timeout: float = LOAD_TIMEOUT) -> bool | None:
        """Return whether the tablet displays its web view; None when it does not say."""
        try:
            scale = number(self._ask("getOnTouchScaleFactor", timeout=timeout), "getOnTouchScaleFactor")
        except CallRefused as error:
            log.debug("the tablet does not say what it shows: %s", error)
            return None
        if scale != OTHER_VIEWS_SCALE:
            self._scale_differs = True
            return True
        return False if self._scale_differs else None

    def _take_away(self) -> None:
        if self.may_be_there:
            try:
                hidden = self._connection.call("ALTabletService", "hideWebview", timeout=HIDE_TIMEOUT)
                self.may_be_there = hidden is False and self._displayed(HIDE_TIMEOUT) is not False
                self._ask("loadUrl", with_changing_query(blank(self.url)), timeout=HIDE_TIMEOUT)
            except RobotError as error:
                log.warning("the page may stay on the tablet: %s", error)
            if not self.may_be_there:
                self._hiding = Retry(FIRST_PAUSE, LONGEST_PAUSE)
        self.shown_since = None
        self._loaded_on, self._load_error = 0, ""
        self.focus.give_back()

    def _demand(self, method: str, *arguments: Any) -> None:
        if self._ask(method, *arguments) is False:
            raise CallRefused(f"ALTabletService.{method} answered false: the tablet is not ready")

    def _ask(self, method: str, *arguments: Any, timeout: float = LOAD_TIMEOUT) -> Any:
        return self._connection.call("ALTabletService", method, *arguments, timeout=timeout)

    def _not_shown(self, problem: str, quiet: bool = False) -> None:
        self.shown_since = None
        if problem != self.problem and not quiet:
            log.warning("the tablet does not show the page: %s; trying again", problem)
        self.problem = problem


def with_changing_query(url: str) -> str:
    """The address with a query that is new every time: the tablet's web view answers from its cache otherwise."""
    parts = urllib.parse.urlsplit(url)
    query = f"{parts.query}&" if parts.query else ""
    return urllib.parse.urlunsplit(
        parts._replace(query=f"{query}t={time.time_ns() // 1_000_000}", path=parts.path or "/")
    )


def blank(url: str) -> str:
    """The address of an empty page beside this one, with its query, which may hold a key."""
    return urllib.parse.urlunsplit(urllib.parse.urlsplit(url)._replace(path=BLANK))


def public(url: str) -> str:
    """The address without its query, which may hold a key."""
    return urllib.parse.urlunsplit(urllib.parse.urlsplit(url)._replace(query=""))
