"""Requests to a robot's web server that end: after a given time, and after a given number of bytes.

Python's HTTP client waits its time-out anew for every piece that arrives, so a server that sends one byte a second
holds it for ever, and it reads as much as comes. Here the connection itself counts time and bytes, so that head, chunks
and trailers are bounded too. No redirect is followed, no proxy asked, no encoding unpacked.
"""

from __future__ import annotations

import http.client
import math
import socket
import struct
import time
from typing import Any, NamedTuple

from telepresence.security.name_lookup import NameLookup

LARGEST_HEAD = 64 * 1024
"""Bytes of status line, headers, chunk sizes and trailers that an answer may have besides its body."""


class BadAnswer(Exception):
    """What came is not an HTTP answer that can be used; the text says why."""


class Answer(NamedTuple):
    """Status, headers and the whole body of an answer."""

    status: int
    headers: http.client.HTTPMessage
    body: bytes


class BoundedConnection(http.client.HTTPConnection):
    """A connection that is kept open between requests; for one thread.

    Args:
        host, port: Of the server.
        timeout: Seconds to look the name up, to connect, and to wait for each piece of an answer.
        lookup: Of this host, which remembers its addresses from one connection to the next.
    """

    def __init__(self, host: str, port: int, timeout: float, lookup: NameLookup | None = None) -> None:
        super().__init__(host, port, timeout=timeout)
        self._lookup = lookup or NameLookup(self.host, self.port)
        self._deadline = math.inf
        self._budget = 0

    def connect(self) -> None:
        """Open the connection; called by `http.client` when there is none."""
        self.sock = _BoundedSocket(self, self._connected())
        self.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _connected(self) -> socket.socket:
        """A socket that is connected to the first of the host's addresses that answers."""
        failure: OSError = OSError(f"{self.host!r} has no address")
        for family, kind, protocol, _, address in self._lookup.addresses(self._patience()):
            plain = socket.socket(family, kind, protocol)
            try:
                plain.settimeout(self._patience())
                plain.connect(address)
                return plain
            except OSError as error:
                plain.close()
                failure = error
        self._lookup.doubt()
        raise failure

    def exchange(
        self, method: str, path: str, body: bytes | None, headers: dict[str, str], deadline: float, limit: int
    ) -> Answer:
        """Ask, and read the whole answer.

        Args:
            deadline: When it must have come [s, monotonic].
            limit: Largest body [bytes].
        Raises:
            BadAnswer: It is not HTTP, too long, cut short or encoded.
            OSError: No connection, or no answer in time; the connection can then not be used any more.
        """
        self._deadline, self._budget = deadline, limit + LARGEST_HEAD
        if self.sock is not None:
            self.sock.settimeout(self._patience())
        try:
            self.request(method, path, body, headers)
            answer = self.getresponse()
            if (encoding := answer.getheader("Content-Encoding", "identity").lower()) != "identity":
                raise BadAnswer(f"the answer is encoded as {encoding!r}, which nobody asked for")
            data = answer.read(limit + 1)
        except http.client.RemoteDisconnected:
            raise  # an OSError too: it hung up, which a kept connection does
        except http.client.HTTPException as error:
            raise BadAnswer(f"{type(error).__name__}: {error}") from None
        except (ValueError, OverflowError) as error:  # a chunk of negative size, a length with 5000 digits
            raise BadAnswer(f"not HTTP: {error}") from None
        if len(data) > limit:
            raise BadAnswer(f"the answer is longer than {limit} bytes")
        if answer.length:
            raise BadAnswer(f"the answer ends {answer.length} bytes too early")
        return Answer(answer.status, answer.headers, data)

    def abandon(self) -> None:
        """Close at once. What was sent and has not been confirmed is thrown away: the network, when it is back, does
        not deliver it to a server that would act on it (socket(7), SO_LINGER of zero seconds)."""
        if self.sock is not None:
            self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.close()

    def _patience(self) -> float:
        """Seconds that the next step may take. Raises TimeoutError when there are none left."""
        left = self._deadline - time.monotonic()
        if left <= 0.0:
            raise TimeoutError("the answer did not come in time")
        return min(float(self.timeout or math.inf), left)

    def _received(self, count: int) -> None:
        self._budget -= count
        if self._budget < 0:
            raise BadAnswer("the answer does not end")


class _BoundedSocket(socket.socket):
    """Takes over a connected socket; asks its connection how long each read may take."""

    def __init__(self, connection: BoundedConnection, plain: socket.socket) -> None:
        timeout = plain.gettimeout()
        super().__init__(plain.family, plain.type, plain.proto, plain.detach())
        self.settimeout(timeout)
        self._connection = connection

    def recv_into(self, *arguments: Any) -> int:
        self.settimeout(self._connection._patience())
        count = super().recv_into(*arguments)
        self._connection._received(count)
        return count
