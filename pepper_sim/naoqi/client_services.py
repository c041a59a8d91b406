"""Calls from the robot to services that clients registered: event callbacks, microphone buffers.

They go over the connection that the client opened, so no client needs an address that the robot can reach. The first
call to a service asks the client what the service looks like and may take long when the client hangs, so it waits on a
thread of this module. Later ones wait on no thread at all, and arrive in their order.
"""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Iterable
from typing import Any

from pepper_sim.naoqi.service import Service
from pepper_sim.naoqi.tasks import Alarm
from telepresence.naoqi.future import Future
from telepresence.naoqi.metaobject import FIRST_OWN_ID, MetaMethod, NoSuchMethod, choose_overload
from telepresence.naoqi.remote_object import RemoteObject
from telepresence.naoqi.server import Server

MAX_FAILURES = 3
"""A subscriber whose calls fail this many times in a row is dropped."""
LOOKUP_WORKERS = 4
CALL_TIMEOUT = 5.0
"""A client that does not answer within this time [s] has failed."""


class ClientServices:
    """Services of clients, by name."""

    def __init__(self, server: Server, alarm: Alarm) -> None:
        self._server = server
        self._alarm = alarm
        self._own: frozenset[str] = frozenset()
        self._offered: dict[str, Service] = {}
        self._known: dict[str, RemoteObject] = {}
        self._lock = threading.Lock()
        self._pool = concurrent.futures.ThreadPoolExecutor(LOOKUP_WORKERS, thread_name_prefix="client-lookup")
        server.serviceUnregistered.connect(lambda _identity, name: self._forget(name))

    @property
    def url(self) -> str:
        """Where a program on the robot's own machine connects."""
        urls = self._server.endpoints
        return next((url for url in urls if "//127." in url), urls[0])

    def names(self) -> list[str]:
        """List all services that are registered now, the robot's own included."""
        return [info["name"] for info in self._server.services()]

    def exists(self, name: str) -> bool:
        """Whether a service of this name is registered now."""
        return name in self.names()

    def is_own(self, name: str) -> bool:
        """Whether a service belongs to the robot itself."""
        return name in self._own

    def remember_own(self) -> None:
        """Regard the services that are registered now as the robot's own."""
        self._own = frozenset(self.names())

    def call(self, name: str, method: str, *arguments: Any) -> concurrent.futures.Future:
        """Call `name`.`method`; the future holds the answer, or what went wrong (RuntimeError, TimeoutError)."""
        done: concurrent.futures.Future = concurrent.futures.Future()
        if name in self._known:
            self._start(done, name, method, arguments)
        else:
            self._pool.submit(self._start, done, name, method, arguments)
        return done

    def offer(self, services: Iterable[Service]) -> None:
        """Let `start` call the robot's own services, too."""
        self._offered = {service.name: service for service in services}

    def start(self, name: str, method: str, *arguments: Any) -> concurrent.futures.Future:
        """Call a method of a client's service or of the robot's own; it may take as long as it needs.

        Raises: RuntimeError: There is no such service or method, or it refuses.
        """
        if name in self._offered:
            return self._start_own(name, method, arguments)
        done: concurrent.futures.Future = concurrent.futures.Future()
        remote = self._remote(name)
        answer = remote.call(_chosen(remote, name, method, arguments), arguments)
        answer.addCallback(lambda answer: _hand_over(answer, done))
        return done

    def _start_own(self, name: str, method: str, arguments: tuple) -> concurrent.futures.Future:
        overloads = [
            binding
            for binding in self._offered[name].bindings()
            if binding.name == method and len(binding.arguments) == len(arguments)
        ]
        if not overloads:
            raise _no_method(name, method)
        binding = next((overload for overload in overloads if overload.takes(*arguments)), overloads[0])
        result = binding(*arguments)
        if isinstance(result, concurrent.futures.Future):
            return result
        done: concurrent.futures.Future = concurrent.futures.Future()
        done.set_result(result)
        return done

    def post(self, name: str, method: str, *arguments: Any) -> None:
        """Call `name`.`method` without waiting for an answer; only the first call may wait, for CALL_TIMEOUT.

        Raises: RuntimeError: There is no such service or method, or it does not take these arguments.
        """
        try:
            remote = self._remote(name)
            chosen = _chosen(remote, name, method, arguments)
            remote.post(chosen.uid, chosen.parameters, arguments)
        except RuntimeError:
            self._forget(name)
            raise

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _start(self, done: concurrent.futures.Future, name: str, method: str, arguments: tuple) -> None:
        """Send a call; `done` ends with its answer, or when the client has not answered in time."""
        try:
            remote = self._remote(name)
            answer = remote.call(_chosen(remote, name, method, arguments), arguments)
        except Exception as error:  # whoever raised the event has nothing to do with it
            self._forget(name)
            return done.set_exception(error)
        late = self._alarm.after(CALL_TIMEOUT)

        def answered(answer: Future) -> None:
            if late.cancel() and not _hand_over(answer, done):
                self._forget(name)

        def give_up(timer: concurrent.futures.Future) -> None:
            if not timer.cancelled():
                self._forget(name)
                answer.cancel()
                done.set_exception(TimeoutError(f"service '{name}' has not answered within {CALL_TIMEOUT:g} s"))

        late.add_done_callback(give_up)
        answer.addCallback(answered)

    def _remote(self, name: str) -> RemoteObject:
        with self._lock:
            remote = self._known.get(name)
        if remote is None:
            remote = self._server.remote_object(name)
            with self._lock:
                self._known[name] = remote
        return remote

    def _forget(self, name: str) -> None:
        with self._lock:
            self._known.pop(name, None)


def _chosen(remote: RemoteObject, name: str, method: str, arguments: tuple) -> MetaMethod:
    """Return the overload that takes the arguments, of the service's own methods: what every object has is no method.

    Raises: RuntimeError: There is none.
    """
    try:
        chosen = choose_overload(remote.meta, method, arguments, remote.connection.dialect)
    except NoSuchMethod:
        raise _no_method(name, method) from None
    except RuntimeError:
        if all(other.uid < FIRST_OWN_ID for other in remote.meta.methods_named(method)):
            raise _no_method(name, method) from None
        raise
    if chosen.uid < FIRST_OWN_ID:
        raise _no_method(name, method)
    return chosen


def _hand_over(answer: Future, done: concurrent.futures.Future) -> bool:
    """Complete `done` with an answer that has come; return whether that is a value."""
    try:
        value = answer.value()
    except Exception as error:  # the client's text; also a cancel that nobody asked for, or no value of its type
        done.set_exception(error)
        return False
    done.set_result(value)
    return True


def _no_method(name: str, method: str) -> RuntimeError:
    return RuntimeError(f"service '{name}' has no method '{method}'")
