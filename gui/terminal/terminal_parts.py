"""The processes that the window's terminal consists of: whether one of them was stopped, and ending them."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import struct
from pathlib import Path

from telepresence.station import vitals

_CREDENTIALS = struct.Struct("3i")  # pid, uid, gid: unix(7)


class TerminalParts:
    """xterm, what it runs, and the tmux server, which is nobody's child.

    Args:
        xterm: Process id.
        server: Path of the tmux server's socket.
    """

    def __init__(self, xterm: int, server: Path) -> None:
        self._xterm, self._path = xterm, server
        self._server = 0

    @property
    def server(self) -> int:
        """Process id of the tmux server; 0 while there is none."""
        self._server = self._server or listener(self._path)
        return self._server

    def stopped(self) -> bool:
        """Whether one of them was stopped, so that the terminal takes no keys."""
        return any(vitals.state(pid) == "T" for pid in self._all())

    def kill(self) -> None:
        """End them at once; what runs in the terminal is told that it has hung up."""
        for pid in self._all():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def _all(self) -> list[int]:
        found, parents = [], [self._xterm] if self._xterm else []  # 0: it could not be started
        while parents:
            parent = parents.pop()
            found.append(parent)
            parents += children(parent)
        server = self.server
        return [*found, server] if vitals.state(server) else found


def listener(path: Path) -> int:
    """Return the process id of who listens at a unix socket; 0 when nobody does."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as connection:
        try:
            connection.connect(str(path))
            credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return 0
    pid, _user, _group = _CREDENTIALS.unpack(credentials)
    return pid


def children(pid: int) -> list[int]:
    """Return the process ids of a program's children; of one that has ended, none.

    The kernel lists them by the thread that has started them: roslaunch starts a node again from another one.
    """
    found = []
    for thread in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            found += [int(child) for child in thread.read_text().split()]
    return found
