"""Starts a drive server for a driver that was started alone, without a launch file and without one on the robot."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

from telepresence.station import processes

PROGRAM = Path(__file__).parents[2] / "robot" / "drive_server.py"
OUTLIVE = 'trap "sleep 1; kill \\$!" INT; trap "kill \\$!" TERM; "$@" & wait; wait'
"""For sh: the program gets a second more than its driver, in which it misses that and brakes."""


class OwnDriveServer:
    """A child process on loopback. It ends a second after the thread that made this, however that ended.

    Args:
        qi_url: Where NAOqi answers.
    Attributes:
        address: host:port of the drive server.
    """

    def __init__(self, qi_url: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"127.0.0.1:{port}"
        words = [sys.executable, str(PROGRAM), "--qi-url", qi_url, "--port", str(port)]
        self._process = processes.start(["sh", "-c", OUTLIVE, "sh", *words], tied=True)

    def close(self) -> None:
        """End it; it brakes first."""
        self._process.terminate()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            processes.end(self._process)
