"""The events of ALMemory, and the modules of clients that they call.

Source: NAOqi 2.8 documentation, ALMemory.
"""

from __future__ import annotations

import concurrent.futures
import functools
import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.client_services import MAX_FAILURES, ClientServices
from pepper_sim.naoqi.service import ServiceError, remote
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.signals import Signal

log = logging.getLogger(__name__)

_HISTORY_LENGTH = 32


class _Event:
    """An event's signal, which fires with each value, and the object that brings it to clients."""

    def __init__(self) -> None:
        self.signal = Signal("(m)")

    @functools.cached_property
    def subscriber(self) -> ServedObject:
        served = ServedObject()
        served.add_signal("signal", self.signal)
        return served


@dataclass
class _Callback:
    """A client's service that is called at an event: method(event, value, message or subscriber's name)."""

    service: str
    method: str
    message: str | None
    failures: int = 0


@dataclass
class Topic:
    """An event: whom it calls, its last values (value, stamp, size), what these weigh together, and the extractor that
    raises it."""

    event: _Event = field(default_factory=_Event)
    callbacks: list[_Callback] = field(default_factory=list)
    history: deque = field(default_factory=lambda: deque(maxlen=_HISTORY_LENGTH))
    past: int = 0
    extractor: str = ""


class MemorySubscriptions:
    """Remote methods of ALMemory.

    Args:
        topics: The events by their names.
        lock: Held while they are looked at or changed.
        clients: Services of clients, which are called.
    Attributes:
        switches: By extractor, what is called with (module, True) when a module subscribes to an event of it, and with
            False when it leaves.
    """

    def __init__(self, topics: dict[str, Topic], lock: threading.Lock, clients: ClientServices) -> None:
        self._topics = topics
        self._lock = lock
        self._clients = clients
        self.switches: dict[str, Callable[[str, bool], None]] = {}

    def call(self, event: str, topic: Topic, value: Any) -> None:
        """Call every module that has subscribed, and return at once."""
        with self._lock:
            callbacks = list(topic.callbacks)
        for callback in callbacks:
            self._call_back(event, topic, callback, value)

    @remote("v(sss)")
    def subscribeToEvent(self, name: str, callbackModule: str, callbackMethod: str) -> None:
        """Calls callbackModule.callbackMethod(name, value, callbackModule) at each event."""
        self._subscribe(name, _Callback(callbackModule, callbackMethod, None))

    @remote("v(ssss)", name="subscribeToEvent")
    def subscribeToEventWithMessage(
        self, name: str, callbackModule: str, callbackMessage: str, callbackMethod: str
    ) -> None:
        """Calls callbackModule.callbackMethod(name, value, callbackMessage) at each event."""
        self._subscribe(name, _Callback(callbackModule, callbackMethod, callbackMessage))

    @remote("v(ssss)")
    def subscribeToMicroEvent(self, name: str, callbackModule: str, callbackMessage: str, callbackMethod: str) -> None:
        """Calls callbackModule.callbackMethod(name, value, callbackMessage) at each micro-event."""
        self._subscribe(name, _Callback(callbackModule, callbackMethod, callbackMessage))

    @remote("v(ss)")
    def unsubscribeToEvent(self, name: str, callbackModule: str) -> None:
        """Ends the calls to callbackModule."""
        self._unsubscribe(name, callbackModule)

    @remote("v(ss)")
    def unsubscribeToMicroEvent(self, name: str, callbackModule: str) -> None:
        """Ends the calls to callbackModule."""
        self._unsubscribe(name, callbackModule)

    @remote("v(s)")
    def unregisterModuleReference(self, moduleName: str) -> None:
        """Ends all calls to a module."""
        with self._lock:
            topics = [topic for topic in self._topics.values() if moduleName in (c.service for c in topic.callbacks)]
            for topic in topics:
                topic.callbacks = [known for known in topic.callbacks if known.service != moduleName]
        for topic in topics:
            self._switch(topic, moduleName)

    @remote("[s](s)")
    def getSubscribers(self, name: str) -> list[str]:
        """Lists the modules that an event calls."""
        with self._lock:
            return [callback.service for callback in self._topics.get(name, Topic()).callbacks]

    def _subscribe(self, event: str, callback: _Callback) -> None:
        if not self._clients.exists(callback.service):
            raise ServiceError(f"callbackModule: cannot find service '{callback.service}'")
        with self._lock:
            topic = self._topics.setdefault(event, Topic())
            topic.callbacks = [known for known in topic.callbacks if known.service != callback.service]
            topic.callbacks.append(callback)
        self._switch(topic, callback.service)
        if not self._clients.exists(callback.service):  # its client has died meanwhile
            self.unregisterModuleReference(callback.service)

    def _unsubscribe(self, event: str, service: str) -> None:
        with self._lock:
            topic = self._topics.get(event)
            if topic is None or service not in [known.service for known in topic.callbacks]:
                raise ServiceError(f"'{service}' has not subscribed to event '{event}'")
            topic.callbacks = [known for known in topic.callbacks if known.service != service]
        self._switch(topic, service)

    def _switch(self, topic: Topic, service: str) -> None:
        """Let the extractor of an event know whether a module is called at any of its events."""
        with self._lock:
            alike = [other for other in self._topics.values() if other.extractor == topic.extractor]
            wanted = any(known.service == service for other in alike for known in other.callbacks)
        switch = self.switches.get(topic.extractor)
        if switch is not None:
            switch(service, wanted)

    def _call_back(self, event: str, topic: Topic, callback: _Callback, value: Any) -> None:
        """Call a client's service and return at once. If it is gone or fails three times in a row, drop it."""

        def done(call: concurrent.futures.Future) -> None:
            error = None if call.cancelled() else call.exception()
            callback.failures = callback.failures + 1 if error else 0
            if callback.failures >= MAX_FAILURES or (error and not self._clients.exists(callback.service)):
                self._drop(event, topic, callback, str(error))

        message = callback.service if callback.message is None else callback.message
        self._clients.call(callback.service, callback.method, event, value, message).add_done_callback(done)

    def _drop(self, event: str, topic: Topic, callback: _Callback, reason: str) -> None:
        with self._lock:
            if callback in topic.callbacks:
                topic.callbacks.remove(callback)
        self._switch(topic, callback.service)
        log.warning("%s is no longer called at %s: %s", callback.service, event, reason)
