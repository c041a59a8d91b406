"""Shows a page on the robot's tablet, again after every reconnection, and takes it away at the end.

Wire (NAOqi 2.5 documentation, ALTabletService): `getWifiStatus()` -> "IDLE", "SCANNING", "DISCONNECTED" or "CONNECTED";
`loadUrl(url)` -> bool; `showWebview()` -> bool; `hideWebview()` -> bool. The tablet is a computer of its own: it
fetches the page itself, over its own Wi-Fi, so the address must be one that it can reach, never "localhost".
"""

from __future__ import annotations

import logging
import threading
import time
import urllib.parse

from naoqi_driver.connection import CallRefused, Connection, RobotError

log = logging.getLogger(__name__)

LOAD_TIMEOUT = 5.0
"""Seconds that the tablet may take to answer; a sleeping one needs a while."""
HIDE_TIMEOUT = 0.5
"""Seconds allowed for taking the page away: a program that ends does not wait for a robot that is gone."""
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 10.0
"""Seconds between two attempts; doubled after every failure."""


class TabletLink:
    """Keeps `url` on the tablet between `start` and `close`.

    Args:
        connection: The link to the robot; started and closed by its owner.
        url: Of the page, as the tablet must ask for it.
    """

    def __init__(self, connection: Connection, url: str) -> None:
        self.url = url
        self.shown_since: float | None = None
        """Monotonic time [s] since when the robot says that it shows the page; None when it does not."""
        self.problem = "not connected yet"
        """Why the page is not shown."""
        self._connection = connection
        self._shown_on = 0  # number of the connection on which it was shown
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tablet-link", daemon=True)

    def start(self) -> TabletLink:
        self._thread.start()
        return self

    def close(self) -> None:
        """Take the page away if it is shown; at most about a second."""
        self._stop.set()
        if self.shown_since is not None and self._connection.connected:
            try:
                self._connection.call("ALTabletService", "hideWebview", timeout=HIDE_TIMEOUT)
            except RobotError as error:
                log.warning("the page stays on the tablet: %s", error)
        if self._thread.ident is not None:
            self._thread.join(timeout=0.5)

    def _run(self) -> None:
        pause = FIRST_PAUSE
        while not self._stop.is_set():
            if not self._connection.connected:
                self.shown_since = None
                self.problem = self._connection.problem or "not connected"
                self._connection.wait_connected(0.2)
            elif self._shown_on == self._connection.connections:
                pause = FIRST_PAUSE
                self._stop.wait(0.2)
            else:
                try:
                    self._show()
                except RobotError as error:
                    self._report(str(error))
                    self._stop.wait(pause)
                    pause = min(2 * pause, LONGEST_PAUSE)
                except Exception:  # top of the thread: it goes on and tries again
                    log.exception("showing the page failed")
                    self._stop.wait(LONGEST_PAUSE)

    def _show(self) -> None:
        number = self._connection.connections
        wifi = self._connection.call("ALTabletService", "getWifiStatus", timeout=LOAD_TIMEOUT)
        if wifi != "CONNECTED":
            log.warning("the tablet's own Wi-Fi is %s: it may not reach %s", wifi, public(self.url))
        for method, arguments in (("loadUrl", (with_changing_query(self.url),)), ("showWebview", ())):
            if self._stop.is_set():
                return
            if self._connection.call("ALTabletService", method, *arguments, timeout=LOAD_TIMEOUT) is False:
                raise CallRefused(f"ALTabletService.{method} answered false: the tablet is not ready")
        self._shown_on = number
        self.shown_since = time.monotonic()
        self.problem = ""
        log.info("the tablet shows %s", public(self.url))

    def _report(self, problem: str) -> None:
        if problem != self.problem:
            log.warning("the tablet does not show the page: %s; trying again", problem)
            self.problem = problem


def with_changing_query(url: str) -> str:
    """The address with a query that is new every time: the tablet's web view answers from its cache otherwise."""
    parts = urllib.parse.urlsplit(url)
    query = f"{parts.query}&" if parts.query else ""
    return urllib.parse.urlunsplit(
        parts._replace(query=f"{query}t={time.time_ns() // 1_000_000}", path=parts.path or "/")
    )


def public(url: str) -> str:
    """The address without its query, which may hold a key."""
    return urllib.parse.urlunsplit(urllib.parse.urlsplit(url)._replace(query=""))
