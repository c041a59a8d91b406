"""What died or froze, on its way to the topic `/station/faults`: one datagram of JSON for each fault to the unix socket
of the node `station_faults` (`telepresence_ros.faults`). Standard library only, and nothing here waits."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections import deque
from dataclasses import asdict, dataclass
from pathlib import Path

SOCKET = "faults"
"""Name of the socket in the folder of a station's watch."""
_KEPT = 50


@dataclass(frozen=True)
class Fault:
    """One fault, in the words of telepresence_msgs/Fault; `stamp` is when it was noticed [s, since 1970]."""

    stamp: float
    program: str
    what: str
    next: str


class FaultReporter:
    """Sends faults; what nobody takes now is kept until somebody does.

    Args:
        path: The socket.
    """

    def __init__(self, path: Path) -> None:
        self._path = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        self._waiting: deque[bytes] = deque(maxlen=_KEPT)
        self._lock = threading.Lock()

    def report(self, program: str, what: str, then: str) -> None:
        """Send a fault that was noticed now, or keep it for `flush`."""
        self._waiting.append(json.dumps(asdict(Fault(time.time(), program, what, then))).encode())
        self.flush()

    def flush(self) -> None:
        """Send what waits, the oldest first."""
        try:
            with self._lock:
                while self._waiting:
                    self._socket.sendto(self._waiting[0], self._path)
                    self._waiting.popleft()
        except OSError:
            return  # nobody listens yet, or the queue is full: at the next call

    def close(self) -> None:
        self._socket.close()


class FaultListener:
    """Receives them, at a socket that it makes anew. Raises OSError."""

    def __init__(self, path: Path) -> None:
        path.unlink(missing_ok=True)  # left by one that was killed
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.bind(os.fspath(path))

    def next(self, timeout: float) -> Fault | None:
        """Return the next fault; None when there is none within `timeout` seconds."""
        self._socket.settimeout(timeout)
        try:
            return Fault(**json.loads(self._socket.recv(65536)))
        except TimeoutError:
            return None

    def close(self) -> None:
        self._socket.close()
