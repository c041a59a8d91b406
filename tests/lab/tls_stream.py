"""A TLS connection that one thread reads while another writes.

Python's own (ssl.SSLSocket, at least until 3.11) hands both to OpenSSL at once, whose objects take one thread at a
time: now and then a websocket's handshake hangs, or a write ends in an error.
"""

from __future__ import annotations

import contextlib
import socket
import ssl
import threading
from typing import Any


class TlsStream:
    """As a connected socket is used by websockets.sync; what is not here is the socket's.

    Args:
        stream: Connected; the handshake is made at once.
        host: Its name, as `server_hostname` of `ssl.SSLContext.wrap_bio`.
    """

    def __init__(self, stream: socket.socket, context: ssl.SSLContext, host: str) -> None:
        self._stream = stream
        self._received, self._to_send = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._tls = context.wrap_bio(self._received, self._to_send, server_hostname=host)
        self._tls_lock, self._send_lock = threading.Lock(), threading.Lock()
        while True:
            try:
                self._tls.do_handshake()
                break
            except ssl.SSLWantReadError:
                self._flush()
                self._fetch()
        self._flush()

    def recv(self, size: int) -> bytes:
        while True:
            with self._tls_lock:
                try:
                    return self._tls.read(size)
                except ssl.SSLWantReadError:
                    pass
                except (ssl.SSLZeroReturnError, ssl.SSLEOFError):
                    return b""
            self._flush()
            self._fetch()

    def sendall(self, data: bytes) -> None:
        with self._tls_lock:
            self._tls.write(data)
        self._flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _fetch(self) -> None:
        data = self._stream.recv(65536)
        with self._tls_lock:
            self._received.write(data) if data else self._received.write_eof()

    def _flush(self) -> None:
        with self._send_lock:
            with self._tls_lock:
                data = self._to_send.read()
            if data:
                self._stream.sendall(data)


def connect(host: str, port: int, context: ssl.SSLContext, timeout: float) -> TlsStream:
    """Connect to a server; every step of it within `timeout` seconds."""
    with contextlib.ExitStack() as opened:
        stream = socket.create_connection((host, port), timeout)
        opened.callback(stream.close)
        made = TlsStream(stream, context, host)
        opened.pop_all()
        return made
