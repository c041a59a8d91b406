"""A web server for WSGI applications whose answers may be endless: gevent on a thread of its own, no monkey patching.

Every connection is a greenlet, so a thousand idle ones cost little. The send buffer is small, because what waits in it
grows old: pictures above all. What a client may cost is in `telepresence.web.connections`.
"""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Callable
from typing import Any

import gevent
import gevent.event
import gevent.socket
from gevent import pywsgi

from telepresence.web.connections import Connections, Handler
from telepresence.web.listener import SEND_BUFFER, listener

log = logging.getLogger(__name__)

SPARE_PLACES = 32
"""Connections taken beyond the limit, so that those that must go for them have the time to."""


class WebServer:
    """Answers a WSGI application from a thread of its own, one greenlet per connection.

    The port is bound by the constructor; `start()` begins to answer. The application must not block: a native lock or
    a computation in it holds up every viewer.

    Args:
        application: WSGI callable, for example a Flask object.
        address, port, send_buffer: See `telepresence.web.listener`.
        timeout: A connection that takes or sends nothing for this long [s] is closed.
        max_connections: Open at the same time; see `telepresence.web.connections` for who goes when more come.
        max_per_address: Of these, for one address that is not this machine's.
        listening: From `listener`, if it has been opened already; then address, port and send_buffer mean nothing.
    """

    def __init__(
        self,
        application: Callable[..., Any],
        address: str = "127.0.0.1",
        port: int = 0,
        *,
        timeout: float = 10.0,
        send_buffer: int = SEND_BUFFER,
        max_connections: int = 256,
        max_per_address: int = 96,
        listening: socket.socket | None = None,
    ) -> None:
        self._socket = listening or listener(address, port, send_buffer)
        self.address, self.port = self._socket.getsockname()[:2]
        if self.address in ("0.0.0.0", "::"):
            log.warning("port %d is open to every network of this machine; give the address of one", self.port)
        self._application = application
        self._max_connections = max_connections
        self._connections = Connections(max_connections, max_per_address)
        self._handler = type("Handler", (Handler,), {"timeout": timeout, "connections": self._connections})
        self._ready = threading.Event()
        self._lock = threading.Lock()  # protects _stopper against close() from another thread
        self._stopper: Any = None
        self._thread = threading.Thread(target=self._run, name=f"web-server-{self.port}", daemon=True)

    @property
    def url(self) -> str:
        """http://address:port/"""
        return f"http://[{self.address}]:{self.port}/" if ":" in self.address else f"http://{self.address}:{self.port}/"

    def start(self) -> WebServer:
        self._thread.start()
        if not self._ready.wait(timeout=5.0):
            raise RuntimeError(f"the web server on port {self.port} did not start; the log says why")
        return self

    def close(self) -> None:
        """Close the port and every connection; at most about a second."""
        with self._lock:
            if self._stopper is not None:
                self._stopper.send()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)
        self._socket.close()

    def __enter__(self) -> WebServer:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        hub = gevent.get_hub()
        stop = gevent.event.Event()
        stopper = hub.loop.async_()
        stopper.start(stop.set)
        with self._lock:
            self._stopper = stopper
        try:
            server = pywsgi.WSGIServer(
                gevent.socket.socket(fileno=self._socket.detach()),
                self._application,
                spawn=self._max_connections + SPARE_PLACES,
                log=None,
                error_log=log,
                handler_class=self._handler,
                environ={"SERVER_NAME": self.address},  # else pywsgi asks the name server for it
            )
            server.start()
            sweeper = gevent.spawn(self._connections.sweep)
            self._ready.set()
            stop.wait()
            sweeper.kill()
            server.stop(timeout=0.1)  # a stream has no end of its own
        except Exception:  # the top of a thread: the log must say why the port is silent
            log.exception("the web server on port %d failed", self.port)
        finally:
            with self._lock:
                self._stopper = None
            stopper.stop()
            stopper.close()
            hub.destroy(destroy_loop=True)
