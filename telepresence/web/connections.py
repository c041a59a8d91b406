"""What one client, or thousands of them, may cost a web server: places, time and memory of connections.

a request line      8 KiB, within a second of connecting; on a kept connection within the server's `timeout`
its headers         MAX_HEAD bytes, MAX_HEADERS lines
all of a request    within REQUEST_TIMEOUT of its first line, body and the beginning of the answer included
taking the answer   nothing taken for `timeout` seconds ends it
after a refusal     LAST_WORDS, and MOST_LAST_WORDS of a body that nobody reads
connections         of one address a share; where all places are taken, whoever has waited longest without a
                    complete request makes room, so that half requests keep nobody out
log                 a line a second, with the number of those that were left out
"""

from __future__ import annotations

import collections
import ipaddress
import logging
import socket
import time
from http import client
from io import BytesIO
from typing import Any

import gevent
from gevent import pywsgi

from telepresence.security.log_flood import LogFlood

log = logging.getLogger(__name__)
log.addFilter(LogFlood())

FIRST_REQUEST_TIMEOUT = 1.0
"""Seconds within which a new connection must send its first line, so that idle ones do not occupy places."""
REQUEST_TIMEOUT = 6.0
"""Seconds from the first line of a request to the beginning of its answer, however slowly the rest of it arrives."""
SWEEP_PERIOD = 0.25
"""Seconds between two looks at who is late."""
MAX_HEAD, MAX_HEADERS = 16384, 64
"""Bytes and lines of one request's headers; browsers send about 1 kB and 20."""
MAX_UNREAD = 65536
"""Bytes of a body that are read though nobody wants them, so that the connection can be kept."""
LAST_WORDS, MOST_LAST_WORDS = 1.0, 8_000_000
"""Seconds for which a peer that was refused may go on sending, and bytes: closed at once, TCP would reset it, and it
might lose the answer (RFC 9112, section 9.6)."""
_TOO_LARGE = b"HTTP/1.1 431 Request Header Fields Too Large\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"


class Connections:
    """The open connections of one server. Its methods belong to the thread that serves them.

    Args:
        places: Connections open at the same time; see the module.
        places_per_address: Of these, for one client address; programs of this machine share theirs and may use all.
    """

    def __init__(self, places: int, places_per_address: int) -> None:
        self._places, self._per_address = places, places_per_address
        self._open: dict[Handler, None] = {}  # a set that remembers the order
        self._of_address: collections.Counter[str] = collections.Counter()

    def enter(self, handler: Handler) -> bool:
        """Whether a new connection may stay; if there is no place left, another one has to go for it."""
        address = handler.client_address[0]
        if self._of_address[address] >= self._per_address and not ipaddress.ip_address(address).is_loopback:
            log.warning("%s has %d connections open: no more", address, self._per_address)
            return False
        if len(self._open) >= self._places:
            waiting = next((one for one in self._open if one.due is not None and not one.ended), None)
            if waiting is not None:
                log.warning("all places are taken: %s waits no longer", address)
                waiting.end()
        self._open[handler] = None
        self._of_address[address] += 1
        return True

    def leave(self, handler: Handler) -> None:
        if self._open.pop(handler, self) is None:
            address = handler.client_address[0]
            self._of_address[address] -= 1
            if not self._of_address[address]:
                del self._of_address[address]

    def served(self, handler: Handler) -> None:
        """Count a connection among the newest again: it has sent a complete request."""
        if len(self._open) >= self._places // 2 and self._open.pop(handler, self) is None:
            self._open[handler] = None

    def sweep(self) -> None:
        """End the connections that are late, for ever."""
        while True:
            gevent.sleep(SWEEP_PERIOD)
            now = time.monotonic()
            for handler in [one for one in self._open if one.due is not None and one.due < now]:
                handler.end()


class Handler(pywsgi.WSGIHandler):
    """One connection: reads requests within the limits, and drops a peer without a traceback: it happens every day."""

    timeout = 10.0
    connections: Connections

    def __init__(self, sock: Any, address: Any, server: Any, rfile: Any = None) -> None:
        sock.settimeout(min(FIRST_REQUEST_TIMEOUT, self.timeout))
        self.due: float | None = time.monotonic() + FIRST_REQUEST_TIMEOUT
        """When the next thing must have come; None while the answer is on its way."""
        self.ended = False
        super().__init__(sock, address, server, rfile)

    def end(self) -> None:
        """Close the connection under whoever reads from it or writes to it."""
        self.ended = True
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except (OSError, AttributeError):  # the peer was quicker
            return

    def handle(self) -> None:
        if not self.connections.enter(self):
            self.socket.close()
            return
        try:
            super().handle()
        except OSError as error:  # it has gone, or had to, before it took what a bad request is answered with
            log.debug("%s: %s", self.client_address[0], error)
        finally:
            self.connections.leave(self)

    def read_requestline(self) -> str:
        line = super().read_requestline()
        self.socket.settimeout(self.timeout)
        self.due = time.monotonic() + REQUEST_TIMEOUT
        return line

    def MessageClass(self, *_: Any) -> Any:
        """Return the headers, read line by line up to the limits."""
        lines, left = [], MAX_HEAD
        line = b"-"
        while line not in (b"\r\n", b"\n"):
            line = self.rfile.readline(left + 1)
            left -= len(line)
            lines.append(line)
            if left < 0 or len(lines) > MAX_HEADERS:
                raise _HeadTooLarge(f"headers of more than {MAX_HEAD} bytes or {MAX_HEADERS} lines")
            if not line:
                raise ValueError("the connection ended within the headers")
        return client.parse_headers(BytesIO(b"".join(lines)), _class=pywsgi.OldMessage)

    def start_response(self, status: str, headers: list[tuple[str, str]], exc_info: Any = None) -> Any:
        self.due = None
        return super().start_response(status, headers, exc_info)

    def run_application(self) -> None:
        self.connections.served(self)
        answered = False
        try:
            super().run_application()
            answered = True
        finally:
            self.due = time.monotonic() + self.timeout  # for what is left of the body, and the next request
            body = self.wsgi_input
            if body.chunked_input or (body.content_length or 0) - body.position > MAX_UNREAD:
                body.chunked_input, body.content_length = False, 0  # pywsgi would read all of it and throw it away
                self.close_connection = True
                if answered:
                    self._discard_rest()

    def _discard_rest(self) -> None:
        """Throw away what a peer that has its answer still sends, until it ends or `sweep` ends it."""
        self.due = time.monotonic() + LAST_WORDS
        left = MOST_LAST_WORDS
        try:
            self.socket.shutdown(socket.SHUT_WR)
            while left > 0 and (more := self.socket.recv(MAX_UNREAD)):
                left -= len(more)
        except OSError:  # it has gone
            return

    def handle_error(self, t: Any, v: Any, tb: Any) -> None:
        if issubclass(t, OSError):
            self.close_connection = True
            log.info("dropped %s: %s", self.client_address[0], v)
        else:
            super().handle_error(t, v, tb)

    def _log_error(self, t: Any, v: Any, tb: Any) -> None:
        if not issubclass(t, gevent.GreenletExit):
            log.error("%.80r failed", self.requestline, exc_info=None if t is None else (t, v, tb))

    def _handle_client_error(self, ex: BaseException) -> Any:
        if self.ended or isinstance(ex, OSError):
            return None
        log.warning("no request of %s: %.120r", self.client_address[0], str(ex))
        return ("431", _TOO_LARGE) if isinstance(ex, _HeadTooLarge) else ("400", pywsgi._BAD_REQUEST_RESPONSE)


class _HeadTooLarge(ValueError):
    """The headers of a request are larger than anybody needs."""
