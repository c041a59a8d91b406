"""Starts a drive server for a driver that was started alone, without a launch file and without one on the robot."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from naoqi_driver.connection import Address
from naoqi_driver.robot_tls import PASSWORD, USER
from telepresence.station import processes

log = logging.getLogger(__name__)

PROGRAM = Path(__file__).parents[2] / "robot" / "drive_server.py"
OUTLIVE = 'trap "sleep 1; kill \\$!" INT; trap "kill \\$!" TERM; "$@" & wait; wait'
"""Script for sh: the program outlives its driver by a second, in which it misses the driver and brakes."""

LISTENS = "listens on udp "


class OwnDriveServer:
    """A child process on loopback and a free port. It ends a second after the thread that made this, however that
    ended.

    Args:
        robot: Where NAOqi answers. User and password go to the program by its environment, which only this user and
            root can read; everybody can read a command line.
        on_end: Called, on a thread of its own, when the program has ended and nobody has closed it.
    Attributes:
        address: host:port of the drive server.
    Raises:
        RuntimeError: It did not start, and has said why on standard error.
    """

    def __init__(self, robot: Address, on_end: Callable[[], None]) -> None:
        words = ["sh", "-c", OUTLIVE, "sh", sys.executable, str(PROGRAM), "--qi-url", robot.url, "--port", "0"]
        login = {USER: robot.user, PASSWORD: robot.password} if robot.encrypted else {}
        environment = {**os.environ, **{name: value for name, value in login.items() if value is not None}}
        self._process = processes.start(words, tied=True, env=environment, stdout=subprocess.PIPE, text=True)
        self._on_end, self._closing = on_end, threading.Event()
        assert self._process.stdout is not None
        # "drive_server: listens on udp 127.0.0.1:40123", perhaps after a line about NAOqi
        said = next((line for line in self._process.stdout if LISTENS in line), "")
        self.address = said.rpartition(" ")[2].strip()
        if not self.address:
            raise RuntimeError("no drive server could be started")
        threading.Thread(target=self._log_lines, name="own drive server", daemon=True).start()

    def close(self) -> None:
        """End it; it brakes first."""
        self._closing.set()
        self._process.terminate()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            processes.end(self._process)

    def _log_lines(self) -> None:
        """Log what it says: a pipe that nobody reads would stop it when it is full."""
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                log.info("%s", line.rstrip())
        if not self._closing.is_set():
            self._on_end()
