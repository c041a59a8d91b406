"""A station with the simulated Pepper, operated by key presses and clicks: its programs, where the robot truly is, and
a desk with a display, a window manager and the operator's window."""

from __future__ import annotations

import contextlib
import math
import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from endings import end_together
from talker import PROBE, REMOTE_WINDOW, Talker
from window_input import Screen

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.teleop.accounts import Users

ROOT = Path(__file__).resolve().parents[2]
QUIET = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
PASSWORD = "correct horse"
SPEED = 0.2
"""[m/s] that the window begins with."""
STEP = 0.05
"""[m/s] of the slider."""
ROWS = 760
"""Height of a screen with a window manager: the window and its title [px]."""
FACES = 8.0
"""Pictures of the pilot a second: as many as the robot's camera takes here."""
STOPPED = 0.01
"""[m/s]"""


class Station:
    """The running programs, and where the robot truly is. Nothing runs before it is started.

    Args:
        people: Accounts: name -> (role, rank).
    """

    told: tuple[str, ...] = ("/truth", "/safety")
    """Topics that a failed test's report shows."""

    def __init__(
        self, folder: Path, people: dict[str, tuple[str, int]], free_port: Callable, wait_until: Callable
    ) -> None:
        self.folder = folder
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            "TELEPRESENCE_USERS": str(folder / "users.db"),
        }
        self.users = Users(folder / "users.db")
        for name, (role, rank) in people.items():
            self.users.add(name, PASSWORD, role, rank)
        self.wait_until = wait_until
        self._running: list[subprocess.Popen] = []
        self._probe: Talker | None = None
        self._remotes: list[Talker] = []

    @property
    def master_uri(self) -> str:
        return self.environment["ROS_MASTER_URI"]

    def start_master(self) -> None:
        self.start("rosmaster", "--core", "-p", self.master_uri.rpartition(":")[2])
        self.wait_until(lambda: master_answers(self.master_uri), "the ROS master answers")
        master_proxy(self.master_uri, 5.0).setParam("/tests", "/com_cam/rate", FACES)

    def start(self, *argv: str) -> subprocess.Popen:
        """A program of the station's environment, until `close`."""
        self._running.append(processes.start(list(argv), env=self.environment, **QUIET))
        return self._running[-1]

    def start_tracking(self) -> None:
        """Begin to follow where the robot is; needs a ROS master."""
        self._probe = Talker(self.environment, PROBE)
        self.watch()

    def watch(self) -> None:
        """Begin to record the topics."""
        self.probe("watch", "/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
        self.probe("watch", "/safety", "telepresence_msgs/SafetyState", ["state", "reason"])
        self.wait_until(self.track, "the simulated robot stands somewhere", timeout=60.0)

    @property
    def tracking(self) -> bool:
        return self._probe is not None

    def end_tracking(self) -> None:
        if self._probe is not None:
            self._probe.close()
            self._probe = None

    def probe(self, name: str, *arguments: object) -> object:
        return self._probe.ask(name, arguments)

    def wrong_tries(self) -> int:
        with contextlib.closing(sqlite3.connect(self.users.path)) as database:
            return database.execute("SELECT coalesce(sum(failed), 0) FROM tries").fetchone()[0]

    def subscriptions(self, node: str) -> list[str]:
        """Topics that a node has subscribed to."""
        _, _, (_, subscribers, _) = master_proxy(self.master_uri, 5.0).getSystemState("/test")
        return [topic for topic, nodes in subscribers if node in nodes]

    def remote(self, name: str) -> Talker:
        """Another window, see remote_window.py."""
        self._remotes.append(Talker(self.environment, REMOTE_WINDOW, self.users.path, name, PASSWORD))
        return self._remotes[-1]

    def dismiss(self) -> None:
        """End the other windows."""
        while self._remotes:
            self._remotes.pop().close()

    def track(self) -> list[tuple[float, float, float]]:
        """(time [s], x, y [m]) since the last `forget`."""
        return [(when, *place) for when, place in self.probe("seen", "/truth")]

    def forget(self) -> None:
        self.probe("forget", "/truth")

    def place(self) -> tuple[float, float]:
        """x, y [m]"""
        self.forget()
        return self.wait_until(self.track, "a pose")[-1][1:]

    def speed(self) -> float:
        """Over the next 0.2 s [m/s]."""
        self.forget()
        track = self.wait_until(
            lambda: (t := self.track()) and t[-1][0] - t[0][0] > 0.2 and t, "poses of a fifth of a second"
        )
        return math.dist(track[0][1:], track[-1][1:]) / (track[-1][0] - track[0][0])

    def stands(self) -> bool:
        return self.speed() < STOPPED

    def drives(self, share: float = 0.5) -> bool:
        return self.speed() > SPEED * share

    def evidence(self) -> str:
        """Return what helps to explain a failed test."""
        if self._probe is None:
            return "nobody looked"
        return "\n".join(f"{topic}: {self.probe('newest', topic)}" for topic in self.told)

    def close(self) -> None:
        self.dismiss()
        self.end_tracking()
        end_together(self._running)


class Desk:
    """A display with a window manager, and the operator's window; `arguments` are those of the window."""

    def __init__(self, screen: Screen, place: Callable, *arguments: str) -> None:
        self.screen, self.find, self._arguments = screen, place, arguments
        self._manager = processes.start(["openbox", "--sm-disable"], env=screen.environment, **QUIET)
        self._corner: tuple[int, ...] | None = None
        self.signed_in = False
        self.pressed: set[str] = set()
        """Names of what was clicked."""
        self.open()

    def open(self) -> None:
        self.signed_in = False
        program = (sys.executable, "-m", "gui", "--tell")
        self.window = self.screen.open_window(*self._arguments, program=program, signed_in=False)

    def sign_in(self, name: str, password: str = PASSWORD) -> None:
        """Sign in on a fresh sign-in page, whose name field has the keyboard."""
        self.screen.do("key", "ctrl+a")
        self.screen.do("type", name)
        self.screen.do("key", "Return")
        self.screen.do("type", password)
        self.screen.do("key", "Return")

    def point_at(self, name: str, page: str = "terminalPage") -> None:
        self.pressed.add(name)
        self.screen.do("mousemove", "--window", self.window.id, *self.find(name, page))

    def click(self, name: str, page: str = "terminalPage") -> None:
        self.point_at(name, page)
        self.screen.do("click", 1)

    def colour(self, x: int, y: int) -> tuple[int, int, int]:
        """Red, green and blue of a point of the window."""
        if self._corner is None:
            told = self.screen.do("mousemove", "--window", self.window.id, 0, 0, "getmouselocation", "--shell")
            self._corner = tuple(int(line.split("=")[1]) for line in told.splitlines()[:2])
        left, top = self._corner
        return self.screen.colour(left + x, top + y)

    def press_until(
        self, name: str, page: str, condition: Callable[[], object], prepare: Callable[[], object] = lambda: None
    ) -> None:
        """Press a button, and again after a while: a program that starts late has missed the first press.

        Args:
            prepare: Does what each press needs before it.
        """
        for _ in range(4):
            prepare()
            self.click(name, page)
            deadline = time.monotonic() + 10.0
            while time.monotonic() < deadline:
                if condition():
                    return
                time.sleep(0.05)
        pytest.fail(f"{name} was pressed and has no effect")

    def show_page(self, page: str) -> None:
        self.screen.do("mousemove", "--window", self.window.id, *self.find.tab(page), "click", 1)

    def set_speed(self, speed: float) -> None:
        """Set the speed by the keys, whatever it was before [m/s]."""
        self.key(*["Next"] * 8, *["Prior"] * (round(speed / STEP) - 1))

    def key(self, *keys: str) -> None:
        self.screen.do("key", *keys)

    def evidence(self) -> str:
        """Return what helps to explain a failed test."""
        return self.screen.evidence()

    def close(self) -> None:
        self.screen.close()
        processes.end(self._manager, patience=5.0)
