"""Calls to a client's service that carry a true raw buffer, which libqi's Python binding would send as a string.

A connection of its own to the service's endpoint: authenticate, get the metaobject, call the method. Only endpoints
that can be reached from here work: a client on another machine that listens on its own loopback cannot be called.
"""

from __future__ import annotations

import contextlib
import itertools
import socket
from typing import Any
from urllib.parse import urlsplit

from pepper_sim.naoqi.codec import (
    CALL,
    ERROR,
    HEADER,
    METAOBJECT,
    POST,
    REPLY,
    CodecError,
    Decoder,
    Encoder,
    Header,
    split_signature,
)

_OBJECT, _METAOBJECT, _AUTHENTICATE = 1, 2, 8
_MAX_REPLY = 16 * 1024 * 1024
_CAPABILITIES = {
    "ClientServerSocket": True,
    "MessageFlags": True,
    "MetaObjectCache": False,
    "RemoteCancelableCalls": False,
    "ObjectPtrUID": False,
    "RelativeEndpointURI": True,
}


def probe(endpoint: str, timeout: float) -> None:
    """Connect and authenticate as a client does, then disconnect.

    Raises:
        OSError, CodecError: Nobody answers within `timeout` [s], or not as qi services do.
    """
    with contextlib.closing(_RawConnection(endpoint, timeout)) as connection:
        connection.authenticate()


class RawClient:
    """One method of one remote service.

    Args:
        endpoint: "tcp://address:port" of the service.
        service: Number of the service in the service directory.
        method: Name; the first overload that takes `arity` arguments is used.
    Raises:
        OSError, CodecError: The service cannot be reached, or does not answer as qi services do.
    """

    def __init__(self, endpoint: str, service: int, method: str, arity: int, timeout: float = 2.0) -> None:
        self._service = service
        self._connection = _RawConnection(endpoint, timeout)
        try:
            self._connection.authenticate()
            reply = self._connection.call(service, _OBJECT, _METAOBJECT, Encoder().put("I", 0))
            self._action, self._parameters = _find(Decoder(reply).get(METAOBJECT)[0], method, arity)
        except BaseException:  # whatever it is, it is raised again; only the socket must not leak
            self._connection.close()
            raise

    def post(self, *arguments: Any) -> None:
        """Call without waiting for an answer; bytes and arrays arrive as raw.

        Raises: OSError, CodecError: The connection is gone or an argument does not fit.
        """
        encoder = Encoder().put(self._parameters, list(arguments))
        self._connection.send(POST, self._service, _OBJECT, self._action, encoder)

    def close(self) -> None:
        self._connection.close()


class _RawConnection:
    """A connection that sends one message at a time and waits for its answer."""

    def __init__(self, endpoint: str, timeout: float) -> None:
        self._numbers = itertools.count(1)
        address = urlsplit(endpoint)
        self._socket = socket.create_connection((address.hostname, address.port), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def authenticate(self) -> None:
        self.call(0, 0, _AUTHENTICATE, Encoder().put("{sm}", _CAPABILITIES))

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def call(self, service: int, obj: int, action: int, arguments: Encoder) -> bytes:
        number = self.send(CALL, service, obj, action, arguments)
        while True:
            header = Header.unpack(self._receive(HEADER.size))
            if header.size > _MAX_REPLY:
                raise CodecError(f"an answer of {header.size} bytes")
            payload = self._receive(header.size)
            if header.identity == number and header.kind == REPLY:
                return payload
            if header.identity == number and header.kind == ERROR:
                raise CodecError(str(Decoder(payload).get("m")))

    def send(self, kind: int, service: int, obj: int, action: int, arguments: Encoder) -> int:
        buffers = arguments.buffers()
        number = next(self._numbers)
        header = Header(number, sum(len(part) for part in buffers), kind, service, obj, action)
        self._socket.sendall(b"".join([header.pack(), *buffers]))
        return number

    def _receive(self, size: int) -> bytes:
        data = bytearray()
        while len(data) < size:
            piece = self._socket.recv(size - len(data))
            if not piece:
                raise CodecError("the connection was closed")
            data += piece
        return bytes(data)


def _find(methods: dict[int, tuple], name: str, arity: int) -> tuple[int, str]:
    """Return action number and parameter signature of a method in a metaobject."""
    for uid, (_, _, known, parameters, *_) in methods.items():
        if known != name:
            continue
        if parameters == "m":  # accepts any arguments
            return uid, "(" + "m" * arity + ")"
        if parameters.startswith("(") and len(split_signature(parameters[1:-1])) == arity:
            return uid, parameters
    raise CodecError(f"the service has no method {name} with {arity} arguments")
