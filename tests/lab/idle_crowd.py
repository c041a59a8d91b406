"""A stranger's program: connections without end to an HTTPS server, none of which asks for anything.

    python tests/lab/idle_crowd.py HOST PORT SENDER MANNER

MANNER is how far each connection comes: "plain", "encrypted" or "half a request". It says "full" when all are open, and
goes on, a new one in place of each that has ended, until its input ends.
"""

from __future__ import annotations

import collections
import contextlib
import socket
import ssl
import sys
import threading

MOST = 400
THREADS = 4
PAUSE = 0.01
"""[s] between two connections of a thread: a stranger who only floods is the network's to stop."""
HALF = b"POST /enter HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{"


class Crowd:
    """See the module."""

    def __init__(self, host: str, port: int, sender: str, manner: str) -> None:
        self._where, self._sender, self._manner = (host, port), sender, manner
        self._context = ssl.create_default_context()
        self._context.check_hostname, self._context.verify_mode = False, ssl.CERT_NONE
        self._open: collections.deque[socket.socket] = collections.deque()
        self._over = threading.Event()
        self._made = 0

    def run(self) -> None:
        """Connect until the input ends."""
        threads = [threading.Thread(target=self._connect) for _ in range(THREADS)]
        for thread in threads:
            thread.start()
        sys.stdin.read()
        self._over.set()
        for thread in threads:
            thread.join()

    def _connect(self) -> None:
        while not self._over.is_set():
            with contextlib.suppress(OSError):  # it is refused, or ended
                connection = socket.create_connection(self._where, 2.0, (self._sender, 0))
                if self._manner != "plain":
                    connection = self._context.wrap_socket(connection)
                if self._manner == "half a request":
                    connection.sendall(HALF)
                self._open.append(connection)
            self._made += 1
            if self._made == MOST:
                print("full", flush=True)
            while len(self._open) > MOST:
                self._open.popleft().close()
            self._over.wait(PAUSE)


if __name__ == "__main__":
    Crowd(sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]).run()
