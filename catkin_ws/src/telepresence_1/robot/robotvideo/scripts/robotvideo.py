#!/usr/bin/env python
# Runs on the robot's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004, UP010, UP024, UP031
"""The service robotvideo.main of robotvideo.pkg: keeps the robot's focus, and a page on the tablet if it was given one.

ALServiceManager starts it (execStart in manifest.xml) and ends it by SIGTERM; it then takes the page away and gives the
focus back. Wire: see telepresence_1.tablet_link and telepresence_1.robot_focus, which do the same from the pilot's
machine for a robot on which nothing is installed.

The page is the one in the file page_url of the package (make_package.py --url); without that file the page is left to
com_cam on the pilot's machine, and this service only keeps the focus.
"""

from __future__ import print_function

import argparse
import os
import signal
import sys
import time

from telepresence.robot_side.naoqi_client import Client, NaoqiError  # scripts/telepresence in the package
from telepresence.robot_side.naoqi_values import error_text

ACTIVITY = "robotvideo/behaviour"
PAGE_FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir, "page_url")
CHECK_PERIOD = 1.0
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
CALM = 60.0
OTHER_VIEWS_SCALE = 1.0
ANSWER_TIMEOUT = 5.0


class Retry(object):
    """Pauses between attempts [s] that double, so that two programs that want the same do not fight."""

    def __init__(self):
        self._pause = FIRST_PAUSE
        self._last = self._next = None

    def due(self, now):
        """Whether an attempt may be made `now` [s]; it then counts as made."""
        if self._next is not None and now < self._next:
            return False
        if self._last is not None and now - self._last > CALM:
            self._pause = FIRST_PAUSE
        self._last, self._next = now, now + self._pause
        self._pause = min(2 * self._pause, LONGEST_PAUSE)
        return True


class RobotVideo(object):
    """Keeps focus and page until `stop`; `url` is "" when the page is somebody else's."""

    def __init__(self, client, url):
        self._client = client
        for name in ("ALAutonomousLife", "ALTabletService") if url else ("ALAutonomousLife",):
            client.service(name)  # or NaoqiError
        self._url = url
        self._stopped = False
        self._loaded = False
        self._focus_retry, self._page_retry = Retry(), Retry()
        self._problems = {}

    def stop(self, *_):
        """Ask `run` to return. It only sets a flag, so signal handlers may call it."""
        self._stopped = True

    def run(self):
        """Return after `stop`, with page and focus given back, or when NAOqi is gone."""
        due = 0.0
        while not self._stopped and self._client.connected():
            now = time.time()
            if now >= due or due - now > CHECK_PERIOD:
                due = now + CHECK_PERIOD
                self._attempt("focus", self._keep_focus)
                if self._url:
                    self._attempt("tablet", self._keep_page)
            time.sleep(0.05)
        if not self._client.connected():
            return
        if self._loaded:
            self._attempt("tablet", self._take_away)
        self._attempt("focus", self._give_back)

    def _attempt(self, what, action):
        try:
            action()
            problem = ""
        except (NaoqiError, EnvironmentError) as error:
            problem = error_text(error)
        if problem and problem != self._problems.get(what):
            print("%s: %s; trying again" % (what, problem))
            sys.stdout.flush()
        self._problems[what] = problem

    def _life(self, method, *arguments):
        return self._client.service("ALAutonomousLife").send(method, *arguments).value(ANSWER_TIMEOUT)

    def _tablet(self, method, *arguments):
        return self._client.service("ALTabletService").send(method, *arguments).value(ANSWER_TIMEOUT)

    def _keep_focus(self):
        if self._life("focusedActivity") == ACTIVITY:
            return
        if self._life("getState") == "disabled":
            raise NaoqiError("autonomous life is off: nothing takes the tablet, and no activity can be in focus")
        if self._focus_retry.due(time.time()):
            self._life("switchFocus", ACTIVITY)

    def _give_back(self):
        if self._life("focusedActivity") == ACTIVITY:
            self._life("stopFocus")

    def _keep_page(self):
        now = time.time()
        if self._loaded and self._displayed():
            return
        if self._page_retry.due(now):
            if not self._loaded:
                changing = "%s%st=%d" % (self._url, "&" if "?" in self._url else "?", now)  # the web view caches
                if not self._tablet("loadUrl", changing):
                    raise NaoqiError("the tablet is not ready")
            self._tablet("showWebview")
            self._loaded = True

    def _take_away(self):
        self._tablet("hideWebview")
        self._tablet("loadUrl", blank(self._url))  # a hidden page stays loaded, and any program may show it again

    def _displayed(self):
        """Whether the tablet says that the web view is on its screen."""
        return self._tablet("getOnTouchScaleFactor") != OTHER_VIEWS_SCALE


def blank(url):
    """The address of an empty page beside this one, with its query, which may hold a key."""
    address, _, query = url.partition("?")
    server = "/".join(address.split("/", 3)[:3])
    return "%s/blank?%s" % (server, query)


def page_url():
    """The page that the package was built for, or ""."""
    if not os.path.exists(PAGE_FILE):
        return ""
    with open(PAGE_FILE) as page:
        return page.read().strip()


def main():
    """Run until SIGTERM or Ctrl-C; return the exit status."""
    parser = argparse.ArgumentParser(description="Keep the robot's focus, and a page on its tablet.")
    parser.add_argument("--qi-url", default=os.environ.get("QI_URL") or "tcp://127.0.0.1:9559", help="the robot")
    parser.add_argument("--url", default=page_url(), help="the page; default: the one of the package, if any")
    options, _ = parser.parse_known_args()
    try:
        client = Client(options.qi_url)
        video = RobotVideo(client, options.url)
    except (NaoqiError, EnvironmentError, ValueError) as error:
        print("robotvideo: %s" % error, file=sys.stderr)
        return 1
    signal.signal(signal.SIGTERM, video.stop)
    signal.signal(signal.SIGINT, video.stop)
    video.run()
    client.close()
    print("Application finished.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
