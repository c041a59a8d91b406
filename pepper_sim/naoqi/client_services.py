"""Calls from the robot to services that clients registered: event callbacks, microphone buffers.

They go over the connection that the client opened, so no client needs an address that the robot can reach, unless the
robot `dials`. Before the first call to a service the client is asked what the service looks like. Calls wait for that
on no thread, so a client that hangs delays nobody else's, and they arrive in their order.
"""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.dialled_services import DialledServices
from pepper_sim.naoqi.service import Service, chosen
from pepper_sim.naoqi.tasks import Alarm
from telepresence.naoqi.future import Future
from telepresence.naoqi.metaobject import FIRST_OWN_ID, MetaMethod, NoSuchMethod, choose_overload
from telepresence.naoqi.remote_object import RemoteObject
from telepresence.naoqi.server import Server

MAX_FAILURES = 3
"""A subscriber whose calls fail this many times in a row is dropped."""
CALL_TIMEOUT = 5.0
"""A client that does not answer within this time [s] has failed."""


@dataclass(eq=False)
class _Call:
    """A call from the request to its end. Whoever cancels `late` completes `done`."""

    service: str
    method: str
    arguments: tuple
    late: concurrent.futures.Future
    done: concurrent.futures.Future = field(default_factory=concurrent.futures.Future)
    answer: Future | None = None


class ClientServices:
    """Services of clients, by name."""

    def __init__(self, server: Server, alarm: Alarm) -> None:
        self._dialled: DialledServices | None = None
        self._server = server
        self._alarm = alarm
        self._own: frozenset[str] = frozenset()
        self._offered: dict[str, Service] = {}
        self._lock = threading.Lock()
        self._waiting: dict[Future, dict[_Call, None]] = {}
        """Client that was asked about its service -> the calls that wait for the answer, in their order."""

    @property
    def url(self) -> str:
        """Where a program on the robot's own machine connects."""
        urls = self._server.endpoints
        return next((url for url in urls if "//127." in url), urls[0])

    @property
    def dials(self) -> bool:
        """Whether clients are called where they listen, and nowhere else."""
        return self._dialled is not None

    def dial(self) -> None:
        """Call clients where they listen from now on, as an ordinary Pepper does; before a client comes."""
        self._dialled = DialledServices(self._server, self.url)

    def names(self) -> list[str]:
        """List all services that are registered now, the robot's own included."""
        return [info["name"] for info in self._server.services()]

    def exists(self, name: str) -> bool:
        """Whether a service of this name is registered now."""
        return name in self.names()

    def on_gone(self, listener: Callable[[str], None]) -> None:
        """Call `listener` with the name of each service that goes, with its client or by itself, on another thread; not
        if somebody has registered that name again by then.
        """
        self._server.serviceUnregistered.connect(lambda _, name: None if self.exists(name) else listener(name))

    def is_own(self, name: str) -> bool:
        """Whether a service belongs to the robot itself."""
        return name in self._own

    def remember_own(self) -> None:
        """Regard the services that are registered now as the robot's own."""
        self._own = frozenset(self.names())

    def call(self, name: str, method: str, *arguments: Any) -> concurrent.futures.Future:
        """Call `name`.`method`; the future holds the answer, or what went wrong (RuntimeError, TimeoutError)."""
        call = _Call(name, method, arguments, self._alarm.after(CALL_TIMEOUT))
        reached = self._reach(name)
        with self._lock:
            waiting = self._waiting.get(reached)
            first = waiting is None and not reached.isFinished()
            if first:
                waiting = self._waiting[reached] = {}
            if waiting is not None:
                waiting[call] = None
        call.late.add_done_callback(lambda timer: self._give_up(call, reached, timer))
        if waiting is None:
            _send(call, reached)
        elif first:
            reached.addCallback(lambda reached: self._send_waiting(reached))
        return call.done

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
        binding = chosen(self._offered[name].bindings(), method, arguments)
        if binding is None:
            raise _no_method(name, method)
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
        remote = self._remote(name)
        chosen = _chosen(remote, name, method, arguments)
        remote.post(chosen.uid, chosen.parameters, arguments)

    def reach(self, name: str) -> concurrent.futures.Future:
        """Find a client's service; the future's RuntimeError says that there is none, or no way to it."""
        done: concurrent.futures.Future = concurrent.futures.Future()
        self._reach(name).addCallback(lambda answer: _hand_over(answer, done))
        return done

    def close(self) -> None:
        if self._dialled is not None:
            self._dialled.close()

    def _reach(self, name: str) -> Future:
        return (self._dialled or self._server).reach(name)

    def _remote(self, name: str) -> RemoteObject:
        """Return what calls a client's service; only the first time it waits, at most CALL_TIMEOUT."""
        reached = self._reach(name)
        reached.wait(CALL_TIMEOUT * 1000.0)
        if reached.isRunning():
            raise RuntimeError(_late(name))
        return reached.value()

    def _send_waiting(self, reached: Future) -> None:
        """Send the calls that wait. One that comes meanwhile joins them, and so does not overtake them."""
        while True:
            with self._lock:
                waiting = self._waiting[reached]
                call = next(iter(waiting), None)
                if call is None:
                    del self._waiting[reached]
                    return
                del waiting[call]
            _send(call, reached)

    def _give_up(self, call: _Call, reached: Future, timer: concurrent.futures.Future) -> None:
        if timer.cancelled():
            return
        with self._lock:
            self._waiting.get(reached, {}).pop(call, None)
        if call.answer is not None:
            call.answer.cancel()
        call.done.set_exception(TimeoutError(_late(call.service)))


def _send(call: _Call, reached: Future) -> None:
    """Send a call to a service whose description, or what kept it from coming, is there."""
    try:
        remote = reached.value()
        call.answer = remote.call(_chosen(remote, call.service, call.method, call.arguments), call.arguments)
    except Exception as error:  # whoever raised the event has nothing to do with it
        if call.late.cancel():
            call.done.set_exception(error)
        return
    call.arguments = ()  # the timer holds the call until its time
    call.answer.addCallback(lambda answer: _hand_over(answer, call.done) if call.late.cancel() else None)


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


def _hand_over(answer: Future, done: concurrent.futures.Future) -> None:
    """Complete `done` with an answer that has come."""
    try:
        value = answer.value()
    except Exception as error:  # the client's text; also a cancel that nobody asked for, or no value of its type
        done.set_exception(error)
    else:
        done.set_result(value)


def _no_method(name: str, method: str) -> RuntimeError:
    return RuntimeError(f"service '{name}' has no method '{method}'")


def _late(name: str) -> str:
    return f"service '{name}' has not answered within {CALL_TIMEOUT:g} s"
