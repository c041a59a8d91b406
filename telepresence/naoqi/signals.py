"""Signals and properties of one's own objects, with the interface of the vendor's package.

Callbacks run on the workers' threads, those of one subscription one at a time and in the order of the emissions; what
they raise is logged. `connect_direct` is for the parts of this package that must have acted before the emission
returns (an event goes out before the reply of the method that emitted it).
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any

from .conversion import convert
from .future import Future, describe, failed
from .log import logger
from .signature import WireError, parse
from .strands import strand_for
from .workers import Strand

_log = logger("signal")
# One count for the process: no link of one signal is by chance a link of another.
_links = itertools.count(1)

Callback = Callable[..., Any]


class Subscriptions:
    """The callbacks of a signal by link. Thread-safe; `changed(bool)` is called with the first and after the last."""

    def __init__(self, changed: Callable[[bool], Any] | None = None) -> None:
        self._lock = threading.Lock()
        self._direct: dict[int, Callback] = {}
        self._queued: dict[int, tuple[Callback, Strand]] = {}
        self.changed = changed

    def __len__(self) -> int:
        return len(self._direct) + len(self._queued)

    def add(self, callback: Callback, direct: bool = False) -> int:
        """Add a callback and return its link."""
        if not callable(callback):
            raise TypeError(f"a callback must be callable, not {type(callback).__name__}")
        link = next(_links)
        with self._lock:
            first = not self._direct and not self._queued
            if direct:
                self._direct[link] = callback
            else:
                self._queued[link] = (callback, own_strand(callback))
        if first:
            self._notify(True)
        return link

    def remove(self, link: int) -> bool:
        """Remove a callback; tell whether there was one."""
        with self._lock:
            found = self._direct.pop(link, None) is not None or self._queued.pop(link, None) is not None
            last = found and not self._direct and not self._queued
        if last:
            self._notify(False)
        return found

    def clear(self) -> None:
        """Remove all callbacks, except the direct ones, which belong to those who serve the signal."""
        with self._lock:
            had = bool(self._queued)
            self._queued.clear()
            last = had and not self._direct
        if last:
            self._notify(False)

    def run(self, args: tuple[Any, ...]) -> None:
        """Call the direct callbacks, and have the others called."""
        with self._lock:
            direct = list(self._direct.values())
            queued = list(self._queued.items())
        for callback in direct:
            try:
                callback(*args)
            except Exception as error:
                _log.warning("Exception caught from signal subscriber: %s", describe(error))
        for link, (callback, strand) in queued:
            strand.submit(self._run_queued, link, callback, args)

    def _run_queued(self, link: int, callback: Callback, args: tuple[Any, ...]) -> None:
        if link not in self._queued:
            return  # disconnected meanwhile
        try:
            callback(*args)
        except Exception as error:
            _log.warning("Exception caught from signal subscriber: %s", describe(error))

    def _notify(self, subscribed: bool) -> None:
        if self.changed is None:
            return
        try:
            self.changed(subscribed)
        except Exception as error:
            _log.warning("Exception caught from the onConnect callback: %s", describe(error))


def own_strand(callback: Callback) -> Strand:
    """Return what keeps the calls of a callback in order: its object's strand, or one of its own."""
    strand = strand_for(callback)
    return Strand() if strand is None else strand


def answer(value: Any, _async: bool) -> Any:
    """Return a value as it is, or as the future that `_async=True` asks for."""
    return Future(value) if _async else value


class _Observable:
    """What signals and properties have in common: a signature, and callbacks."""

    def __init__(self, signature: str = "m", onConnect: Callable[[bool], Any] | None = None) -> None:
        _checked(signature)
        self._signature = signature
        self._subscriptions = Subscriptions(onConnect)

    @property
    def signature(self) -> str:
        """The types of the arguments of a signal, or of a property's value."""
        return self._signature

    @property
    def watched(self) -> bool:
        """Whether somebody's function is called with the first and after the last callback."""
        return self._subscriptions.changed is not None

    def connect_direct(self, callback: Callback) -> int:
        """Have a short callback called by the thread that emits or sets, before it goes on; return its link."""
        return self._subscriptions.add(callback, direct=True)

    def disconnectAll(self, _async: bool = False) -> Any:
        """Remove all callbacks and return True."""
        self._subscriptions.clear()
        return answer(True, _async)


class Signal(_Observable):
    """An event of an object. `signal(*args)` emits it; `onConnect(bool)` learns of the first and the last callback.

    signature: A tuple of types such as "(is)", or "m" for any arguments. WireError, a RuntimeError: it is none.
    """

    def connect(self, callback: Callback, _async: bool = False) -> Any:
        """Have `callback(*args)` called at each emission; return the link to disconnect it with."""
        return answer(self._subscriptions.add(callback), _async)

    def disconnect(self, id: int, _async: bool = False) -> Any:
        """Remove the callback with this link and return whether there was one."""
        found = self._subscriptions.remove(id)
        if not found:
            _log.warning("disconnect: No subscription found for SignalLink %s.", id)
        return answer(found, _async)

    def emit(self, *args: Any) -> None:
        """Emit the signal with these arguments."""
        self._subscriptions.run(args)

    __call__ = emit


class Property(_Observable):
    """A value of an object that others may read, write and observe. Values are converted to the signature's type.

    signature: One type such as "f", or "m" for any value. WireError, a RuntimeError: it is none.
    """

    def __init__(self, signature: str = "m", onConnect: Callable[[bool], Any] | None = None) -> None:
        super().__init__(signature, onConnect)
        self._lock = threading.Lock()
        self._value: Any = default_of(signature)

    def value(self, _async: bool = False) -> Any:
        """Return the value."""
        return answer(self._value, _async)

    def setValue(self, value: Any, _async: bool = False) -> Any:
        """Set the value and call the callbacks with it. RuntimeError: it is not of the type."""
        try:
            converted = convert(value, self._signature) if self._signature != "m" else value
        except RuntimeError as error:
            if not _async:
                raise
            return failed(error)
        with self._lock:
            self._value = converted
        self._subscriptions.run((converted,))
        return answer(None, _async)

    def connect(self, cb: Callback, _async: bool = False) -> Any:
        """Have `cb(value)` called whenever the value is set; return the link to disconnect it with."""
        return answer(self._subscriptions.add(cb), _async)

    addCallback = connect

    def disconnect(self, id: int, _async: bool = False) -> Any:
        """Remove the callback with this link and return whether there was one."""
        return answer(self._subscriptions.remove(id), _async)


def _checked(signature: str) -> None:
    if not signature:
        raise WireError("Invalid signature")
    parse(signature)


_DEFAULTS = {"b": False, "f": 0.0, "d": 0.0, "s": "", "r": b"", **dict.fromkeys("cCwWiIlL", 0)}


def default_of(signature: str) -> Any:
    """Return the value that a property of this type has before the first `setValue`."""
    kind = parse(signature)
    if kind.code in "[#~":
        return []
    if kind.code == "{":
        return {}
    if kind.code == "(":
        return tuple([default_of(child.full) for child in kind.children])
    return _DEFAULTS.get(kind.code)
