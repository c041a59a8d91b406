"""What the page needs of a station: a ROS master, drive_lease, pictures with their time in them, the page's program."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from open_page import PASSWORD
from page_browser import Browser
from ros_graph import wait_for

from telepresence.station import processes
from telepresence.teleop.accounts import Users

HERE = Path(__file__).resolve().parent
TOPIC = "/pepper_robot/camera/front/image_raw"
RATE = 30.0


class PageStation:
    """A running station with a page.

    Args:
        environment: With the address of a ROS master.
        port: Of the page.
        address: Of this machine, for browsers.
        before: Words that start a program on another machine.
        sign_in: Whether people need a password; a window on the same graph would have to know it, too.
        camera: Whether pictures with their time in them come; else a robot has to send its own.
    """

    def __init__(
        self,
        environment: dict[str, str],
        port: int,
        address: str = "127.0.0.1",
        before: tuple[str, ...] = (),
        sign_in: bool = True,
        camera: bool = True,
    ) -> None:
        self._environment, self._before = environment, before
        self._folder = tempfile.TemporaryDirectory(prefix="bench-page-")
        self._log = Path(self._folder.name, "log")
        self._started: list[subprocess.Popen] = []
        users = Users(Path(self._folder.name, "users.db"))
        users.add("anna", PASSWORD, "pilot")
        needed = str(sign_in).lower()
        self.start("rosrun", "avatar_gui", "drive_lease", f"_users:={users.path}", f"_sign_in:={needed}")
        if camera:
            self.start(sys.executable, str(HERE / "pictures.py"), TOPIC, str(RATE))
        words = ("--port", str(port), "--address", address, "--users", str(users.path), "--sign-in", needed)
        self.start("rosrun", "pilot_page", "pilot_page", *words, "--certificates", self._folder.name)
        self.url = f"https://{address}:{port}/"
        wait_for(lambda: re.search(r"the pilot's page: https://", self._log.read_text()), "the page's program")

    def start(self, *argv: str) -> subprocess.Popen:
        """Run a program of the station until it is closed."""
        with self._log.open("a") as log:
            started = processes.start(
                [*self._before, *argv],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                tied=True,
            )
        self._started.append(started)
        return started

    @contextlib.contextmanager
    def browser(self) -> Iterator[Browser]:
        """Yield a browser in which anna sees the picture and has the robot."""
        browser = Browser(self.url)
        try:
            wait_for(lambda: browser.evaluate("document.getElementById('enter')?.hidden === false"), "the page")
            browser.sign_in("anna")
            wait_for(browser.is_there, "the picture, and the robot")
            yield browser
        finally:
            browser.tools.close()

    def close(self) -> None:
        for started in reversed(self._started):
            processes.end(started)
        self._folder.cleanup()


def picture_ages(browser: Browser, seconds: float, warm_up: float) -> list[float]:
    """Return the ages of the pictures that a browser shows [s]."""
    browser.evaluate((HERE / "strip_reader.js").read_text() + "; 0")
    time.sleep(warm_up)
    browser.evaluate("bench.ages.length = bench.unread = 0")
    time.sleep(seconds)
    ages, unread = browser.evaluate("[bench.ages, bench.unread]")
    if len(ages) < RATE * seconds / 3 or unread > len(ages) / 10:
        raise RuntimeError(f"{len(ages)} pictures in {seconds:.0f} s, and {unread} without a time")
    return [age / 1e3 for age in ages]
