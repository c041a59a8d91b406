"""One object at the other end of a connection: calls to it, and its end."""

from __future__ import annotations

import struct
import sys
import threading
from collections.abc import Sequence
from typing import Any

from .codec import decode, encode_arguments, encode_dynamic_arguments
from .connection import LOST, Connection
from .future import Future
from .message import CANCELED, DYNAMIC_PAYLOAD, ERROR, REPLY
from .metaobject import MetaMethod, MetaObject
from .reactor import reactor
from .signature import WireError, parse

TERMINATE = 3
NOT_CONNECTED = "Socket is not connected"
DISCONNECTED = "Socket Disconnected"
_ERROR_STATE, _VALUE_STATE = 3, 4


class Reply(Future):
    """The answer to a call, decoded by the first thread that asks for it."""

    __slots__ = ("_flags", "_returns", "identity", "remote")

    def __init__(self, remote: RemoteObject, returns: str) -> None:
        super().__init__()
        self.remote: RemoteObject = remote
        self._returns = returns
        self._flags = 0
        self.identity = 0

    def done(self, kind: int, flags: int, payload: Any) -> None:
        """Take what ended the call; runs on the reactor's thread."""
        self.remote.pending.pop(self, None)
        if kind == REPLY:
            self._flags = flags
            self._finish(_VALUE_STATE, payload, _lazily)
        elif kind == ERROR:
            self._finish(_ERROR_STATE, payload, _lazily)
        elif kind == CANCELED:
            self.finish_canceled()
        elif kind == LOST:
            self.finish_with_error(self.remote.loss(str(payload)))

    def cancel(self) -> None:
        """Ask the other side to end the call. It ends when that agrees, and that may be with a value."""
        remote = self.remote
        if self.isRunning() and remote is not None:
            self._cancel_requested = True
            remote.connection.cancel_call(self.identity, remote.service, remote.object)

    def _decode_now(self) -> None:
        with self._lock:
            if self._decode is None:
                return
            self._decode = None
            remote, self.remote = self.remote, _NOBODY  # a result that is kept must not keep what it came from
            failed = self._state == _ERROR_STATE
            if not failed and self._state != _VALUE_STATE:
                return
            signature = "m" if failed or self._flags & DYNAMIC_PAYLOAD else self._returns
            try:
                result = decode(signature, self._result, objects=remote.objects)
            except WireError as error:
                self._state, self._result = _ERROR_STATE, error
                return
            if failed and isinstance(result, (bytes, bytearray)):
                result = bytes(result).decode("utf-8", "replace")
            self._result = str(result) if failed else result


_NOBODY: Any = None
"""Placeholder for the remote object of a reply that is only decoded."""


def _lazily(payload: Any) -> Any:
    raise NotImplementedError("a Reply decodes by itself")


class RemoteObject:
    """What a proxy, its methods and its signals share.

    Args:
        connection: Over which all calls to it go.
        service, object: Its numbers there.
        meta: Its members.
        reference: It was passed by reference: the other end is told when nobody here holds it any more.
        uid: Its identity, if known.
        lost_text: What its pending calls fail with when the connection ends.
    """

    def __init__(
        self,
        connection: Connection,
        service: int,
        object: int,
        meta: MetaObject,
        *,
        reference: bool = False,
        lost_text: str = DISCONNECTED,
        uid: bytes = b"",
    ) -> None:
        self.connection = connection
        self.service = service
        self.object = object
        self.meta = meta
        self.reference = reference
        self.lost_text = lost_text
        self.uid = uid
        self.objects = connection.objects(service)
        self.pending: dict[Reply, None] = {}
        self.removed = False
        self.own_links: dict[int, set[int]] = {}
        self._lock = threading.Lock()

    def __del__(self) -> None:
        # A finalizer may run anywhere, even inside the connection's own code: it only leaves a note for the reactor.
        if getattr(self, "reference", False) and not sys.is_finalizing() and not self.connection.closed:
            reactor().call_soon(_terminate, self.connection, self.service, self.object)

    @property
    def alive(self) -> bool:
        """Whether calls can be made."""
        return not self.removed and not self.connection.closed

    def loss(self, reason: str) -> str:
        """Return the text with which a call fails whose connection is lost."""
        return NOT_CONNECTED if reason == NOT_CONNECTED else self.lost_text

    def remove(self, text: str) -> None:
        """The service is gone: pending calls fail with this text, later ones as on a lost connection."""
        self.removed = True
        for reply in list(self.pending):
            reply.finish_with_error(text)
        self.pending.clear()

    def start(self, action: int, payload: Sequence[Any], returns: str, flags: int = 0) -> Future:
        """Send a call that is encoded already; return the future of a value of the type `returns`."""
        reply = Reply(self, returns)
        if self.removed:
            reply.finish_with_error(NOT_CONNECTED)
            return reply
        self.pending[reply] = None
        reply.identity = self.connection.start_call(self.service, self.object, action, payload, flags, reply.done)
        return reply

    def call(self, method: MetaMethod, arguments: Sequence[Any]) -> Future:
        """Call a method. RuntimeError: the arguments have no form on the wire."""
        payload, flags = self.encode(method.parameters, arguments)
        return self.start(method.uid, payload, method.returns, flags)

    def encode(self, parameters: str, arguments: Sequence[Any]) -> tuple[Sequence[Any], int]:
        """Return a payload and its flags: arguments that do not convert here go as they are, if the peer takes them."""
        connection = self.connection
        try:
            return encode_arguments(parameters, arguments, objects=self.objects, dialect=connection.dialect), 0
        except WireError:
            if parameters == "m" or not connection.shared("MessageFlags"):
                raise
        payload = encode_dynamic_arguments(arguments, objects=self.objects, dialect=connection.dialect)
        return payload, DYNAMIC_PAYLOAD

    def post(self, uid: int, parameters: str, arguments: Sequence[Any]) -> None:
        """Call without an answer, or emit a signal."""
        payload, flags = self.encode(parameters, arguments)
        if self.alive:
            self.connection.post(self.service, self.object, uid, payload, flags)


def _terminate(connection: Connection, service: int, object: int) -> None:
    forget_registrations(connection, service, object)
    connection.post(service, object, TERMINATE, [struct.pack("<I", service)])


def forget_registrations(connection: Connection, service: int, object: int) -> None:
    """Drop the subscriptions to the signals of an object that has ended."""
    for key in list(connection.registrations):
        if key[:2] == (service, object):
            connection.registrations.pop(key, None)
            connection.off_event(*key)


def arity(parameters: str) -> int:
    """Return how many arguments a method takes, -1: any number, -2: its signature cannot be read."""
    if parameters == "m":
        return -1
    try:
        kind = parse(parameters)
    except WireError:
        return -2
    return len(kind.children) if kind.code == "(" else -2
