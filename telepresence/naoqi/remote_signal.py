"""Signals and properties of objects at the other end.

All subscribers of one signal on one connection share one registration, made with the first and removed with the last.
An event is decoded once, by the worker that needs it first; each subscriber gets all events in order.
"""

from __future__ import annotations

import itertools
import struct
import threading
import weakref
from collections.abc import Callable
from typing import Any

from .codec import decode_arguments
from .dynamics import Typed
from .future import Future, describe, failed
from .log import logger
from .remote_object import RemoteObject
from .signals import own_strand
from .workers import Strand

REGISTER, UNREGISTER = 0, 1
PROPERTY, SET_PROPERTY = 5, 6
UNKNOWN_LINK = "Cannot find local signal connection."
MAX_WAITING_BYTES = 64 * 1024 * 1024
"""Events of one signal that wait for slow subscribers; above it new ones are dropped [bytes]."""
MAX_WAITING_EVENTS = 100_000
"""The same, counted."""

_log = logger("signal")
_links = itertools.count(1)


class _Event:
    """The values of one event, decoded when first needed."""

    __slots__ = ("_flags", "_lock", "_payload", "_values", "left", "size")

    def __init__(self, payload: Any, flags: int, subscribers: int) -> None:
        self._payload, self._flags = payload, flags
        self._values: tuple[Any, ...] | None = None
        self._lock = threading.Lock()
        self.size = len(payload)
        self.left = subscribers

    def values(self, signature: str, objects: Any) -> tuple[Any, ...]:
        """Return the values. WireError: they are none of that signature."""
        with self._lock:
            if self._values is None:
                self._values = tuple(decode_arguments(signature, self._payload, self._flags, objects=objects)[0])
                self._payload = b""
            return self._values


class Registration:
    """All subscriptions of this process to one signal of one object on one connection."""

    def __init__(self, remote: RemoteObject, uid: int, signature: str) -> None:
        # Not the remote object itself: that must end when the proxies do, and it ends this.
        self._connection = weakref.ref(remote.connection)
        self._service, self._object, self._uid = remote.service, remote.object, uid
        self._signature = signature
        self._objects = remote.objects
        self._lock = threading.Lock()
        self._callbacks: dict[int, tuple[Callable[..., Any], Strand]] = {}
        self._link = 0
        self._registered: Future | None = None
        self._waiting_bytes = self._waiting_events = 0
        self._dropping = False

    def add(self, remote: RemoteObject, callback: Callable[..., Any]) -> tuple[int, Future]:
        """Add a callback; return its link and the future of the registration."""
        with self._lock:
            # Links need only differ per object; this is the form libqi uses.
            link = (self._uid << 32) | (next(_links) & 0xFFFFFFFF)
            first = not self._callbacks
            self._callbacks[link] = (callback, own_strand(callback))
            if first:
                remote.connection.on_event(self._service, self._object, self._uid, self._arrived)
                self._link = link
                payload = struct.pack("<IIQ", self._object, self._uid, link)
                self._registered = remote.start(REGISTER, [payload], "L")
            registered = self._registered
        assert registered is not None
        return link, registered

    def remove(self, remote: RemoteObject, link: int) -> Future | None:
        """Remove a callback; return the future of the end of it, None if there is no such link."""
        with self._lock:
            if self._callbacks.pop(link, None) is None:
                return None
            if self._callbacks:
                return Future(None)
            remote.connection.off_event(self._service, self._object, self._uid)
            if not remote.alive:
                return Future(None)
            return remote.start(UNREGISTER, [struct.pack("<IIQ", self._object, self._uid, self._link)], "v")

    def _arrived(self, flags: int, payload: Any) -> None:
        """Take an event; runs on the reactor's thread."""
        with self._lock:
            callbacks = list(self._callbacks.items())
            if not callbacks:
                return
            if self._waiting_bytes > MAX_WAITING_BYTES or self._waiting_events > MAX_WAITING_EVENTS:
                dropping, self._dropping = self._dropping, True
                if not dropping:
                    _log.warning("subscribers of signal %d are too slow: events are dropped", self._uid)
                return
            event = _Event(payload, flags, len(callbacks))
            self._waiting_events += 1
            self._waiting_bytes += event.size
        for link, (callback, strand) in callbacks:
            strand.submit(self._run, link, callback, event)

    def _run(self, link: int, callback: Callable[..., Any], event: _Event) -> None:
        try:
            if link in self._callbacks:  # otherwise disconnected meanwhile
                callback(*event.values(self._signature, self._objects))
        except Exception as error:
            _log.warning("Exception caught from signal subscriber: %s", describe(error))
        finally:
            with self._lock:
                event.left -= 1
                if event.left == 0:
                    self._waiting_events -= 1
                    self._waiting_bytes -= event.size
                    if not self._waiting_events:
                        self._dropping = False


def registration(remote: RemoteObject, uid: int, signature: str) -> Registration:
    """Return the registration of a signal, shared by all proxies of the object on this connection."""
    key = (remote.service, remote.object, uid)
    table = remote.connection.registrations
    return table.get(key) or table.setdefault(key, Registration(remote, uid, signature))


class RemoteSignal:
    """A signal of an object at the other end: `signal.connect(callback)`, `signal(*args)` to emit it."""

    def __init__(self, remote: RemoteObject, uid: int, name: str, signature: str) -> None:
        self._remote = remote
        self._uid = uid
        self._name = name
        self._signature = signature

    def __repr__(self) -> str:
        return f"<signal {self._name}::{self._signature}>"

    def connect(self, callback: Callable[..., Any], _async: bool = False) -> Any:
        """Have `callback(*args)` called at each event; return the link to disconnect it with.

        RuntimeError: the object is gone, or the other end refuses.
        """
        if not callable(callback):
            raise TypeError(f"a callback must be callable, not {type(callback).__name__}")
        shared = registration(self._remote, self._uid, self._signature)
        link, registered = shared.add(self._remote, callback)
        self._remote.own_links.setdefault(self._uid, set()).add(link)

        def undo_failure(done: Future) -> None:
            if done.hasError() or done.isCanceled():
                self._remote.own_links[self._uid].discard(link)
                shared.remove(self._remote, link)

        if _async:
            registered.addCallback(undo_failure)
            return registered.andThen(lambda _: link)
        try:
            registered.value()
        except RuntimeError:
            undo_failure(registered)
            raise
        return link

    def disconnect(self, id: int, _async: bool = False) -> Any:
        """Remove the callback with this link. RuntimeError: there is none."""
        ended = registration(self._remote, self._uid, self._signature).remove(self._remote, id)
        self._remote.own_links.get(self._uid, set()).discard(id)
        if ended is None:
            ended = failed(UNKNOWN_LINK)
        return ended if _async else ended.value()

    def disconnectAll(self, _async: bool = False) -> Any:
        """Remove all callbacks that were connected through this proxy."""
        shared = registration(self._remote, self._uid, self._signature)
        ended = Future(None)
        for link in sorted(self._remote.own_links.pop(self._uid, set())):
            ended = shared.remove(self._remote, link) or ended
        return ended if _async else ended.value()

    def __call__(self, *args: Any) -> None:
        """Emit the signal: all subscribers get it, those of other programs too."""
        self._remote.post(self._uid, self._signature, args)

    emit = __call__


class RemoteProperty(RemoteSignal):
    """A property of an object at the other end; callbacks get the new value."""

    def __init__(self, remote: RemoteObject, uid: int, name: str, signature: str) -> None:
        super().__init__(remote, uid, name, f"({signature})")

    def value(self, _async: bool = False) -> Any:
        """Return the value."""
        payload, _ = self._remote.encode("(m)", (self._key(),))
        result = self._remote.start(PROPERTY, payload, "m")
        return result if _async else result.value()

    def setValue(self, value: Any, _async: bool = False) -> Any:
        """Set the value. RuntimeError: it is not of the type, or the other end refuses."""
        payload, _ = self._remote.encode("(mm)", (self._key(), value))
        result = self._remote.start(SET_PROPERTY, payload, "v")
        return result if _async else result.value()

    addCallback = RemoteSignal.connect

    def _key(self) -> Any:
        return Typed("I", self._uid)

    def __call__(self, *args: Any) -> None:
        raise TypeError("a property is set by setValue(value)")
