"""Starts a drive server for a driver that was started alone, without a launch file and without one on the robot."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from telepresence.station import processes

PROGRAM = Path(__file__).parents[2] / "robot" / "drive_server.py"
OUTLIVE = 'trap "sleep 1; kill \\$!" INT; trap "kill \\$!" TERM; "$@" & wait; wait'
"""For sh: the program gets a second more than its driver, in which it misses that and brakes."""


class OwnDriveServer:
    """A child process on loopback and a free port. It ends a second after the thread that made this, however that
    ended.

    Args:
        qi_url: Where NAOqi answers.
    Attributes:
        address: host:port of the drive server.
    Raises:
        RuntimeError: It did not start, and has said why on standard error.
    """

    def __init__(self, qi_url: str) -> None:
        words = ["sh", "-c", OUTLIVE, "sh", sys.executable, str(PROGRAM), "--qi-url", qi_url, "--port", "0"]
        self._process = processes.start(words, tied=True, stdout=subprocess.PIPE, text=True)
        # "the drive server listens on udp 127.0.0.1:40123", and nothing more
        self.address = self._process.stdout.readline().rpartition(" ")[2].strip() if self._process.stdout else ""
        if not self.address:
            raise RuntimeError("no drive server could be started")

    def close(self) -> None:
        """End it; it brakes first."""
        self._process.terminate()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            processes.end(self._process)
