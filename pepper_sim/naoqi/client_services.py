"""Calls from the robot to services that clients registered: event callbacks, microphone buffers.

They go over the connection that the client opened, so no client needs an address that the robot can reach. A robot that
`dials` makes them as its programs beside the service directory do: it connects to an address that the client announces,
and finds no service that announces none; so does an ordinary Pepper (ros-naoqi/naoqi_driver, issues 96, 107, 158).

The first call to a service asks the client what the service looks like and may take long when the client hangs, so it
waits on a thread of this module. Later ones wait on no thread at all, and arrive in their order.
"""

from __future__ import annotations

import concurrent.futures
import logging
import threading
from collections.abc import Iterable
from typing import Any

from pepper_sim.naoqi.service import Service, ServiceError
from pepper_sim.naoqi.tasks import Alarm
from telepresence.naoqi.future import Future
from telepresence.naoqi.server import Server
from telepresence.naoqi.session import Session

log = logging.getLogger(__name__)

MAX_FAILURES = 3
"""A subscriber whose calls fail this many times in a row is dropped."""
LOOKUP_WORKERS = 4
CALL_TIMEOUT = 5.0
"""A client that does not answer within this time [s] has failed."""


class ClientServices:
    """Services of clients, by name.

    Attributes:
        dials: They are called where they listen, and nowhere else; to be set before a client comes.
    """

    dials = False

    def __init__(self, server: Server, alarm: Alarm) -> None:
        self._server = server
        self._alarm = alarm
        self._own: frozenset[str] = frozenset()
        self._offered: dict[str, Service] = {}
        self._proxies: dict[str, Any] = {}
        self._beside: Session | None = None
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
        if name in self._proxies:
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
        try:
            answer = getattr(self._proxy(name), method)(*arguments, _async=True)
        except AttributeError:
            raise _no_method(name, method) from None

        def finish(answer: Future) -> None:
            if answer.hasError():
                done.set_exception(RuntimeError(answer.error()))
            else:
                done.set_result(answer.value())

        answer.addCallback(finish)
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
            self._proxy(name).post(method, *arguments)
        except AttributeError:
            raise _no_method(name, method) from None
        except RuntimeError:
            self._forget(name)
            raise

    def reach(self, name: str) -> concurrent.futures.Future:
        """Find a client's service; the future's ServiceError says that there is none, or no way to it."""
        return self._pool.submit(self._proxy, name)

    def close(self) -> None:
        if self._beside is not None:
            self._beside.close()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _start(self, done: concurrent.futures.Future, name: str, method: str, arguments: tuple) -> None:
        """Send a call; `done` ends with its answer, or when the client has not answered in time."""
        try:
            answer = getattr(self._proxy(name), method)(*arguments, _async=True)
        except AttributeError:
            return done.set_exception(_no_method(name, method))
        except RuntimeError as error:
            self._forget(name)
            return done.set_exception(error)
        late = self._alarm.after(CALL_TIMEOUT)

        def answered(answer: Future) -> None:
            if not late.cancel():
                return
            if answer.hasError():
                self._forget(name)
                done.set_exception(RuntimeError(answer.error()))
            else:
                done.set_result(answer.value())

        def give_up(timer: concurrent.futures.Future) -> None:
            if not timer.cancelled():
                self._forget(name)
                answer.cancel()
                done.set_exception(TimeoutError(f"service '{name}' has not answered within {CALL_TIMEOUT:g} s"))

        late.add_done_callback(give_up)
        answer.addCallback(answered)

    def _proxy(self, name: str) -> Any:
        with self._lock:
            proxy = self._proxies.get(name)
        if proxy is None:
            proxy = self._dialled(name) if self.dials else self._server.remote(name)
            with self._lock:
                self._proxies[name] = proxy
        return proxy

    def _dialled(self, name: str) -> Any:
        """Return a proxy of a client's service over a connection to an address that its record names."""
        own = set(self._server.endpoints)
        records = [info["endpoints"] for info in self._server.services() if info["name"] == name]
        if not records or set(records[0]) <= own:  # the directory names itself for a client that does not listen
            raise ServiceError(f"Can't find service: {name}")
        try:
            with self._lock:
                if self._beside is None or not self._beside.isConnected():
                    self._beside = Session()
                    self._beside.connect(self.url)
            return self._beside.service(name)
        except RuntimeError as error:
            log.info("'%s' cannot be reached at %s: %s", name, ", ".join(records[0]), error)
            raise ServiceError(f"Can't find service: {name}") from None

    def _forget(self, name: str) -> None:
        with self._lock:
            self._proxies.pop(name, None)


def _no_method(name: str, method: str) -> RuntimeError:
    return RuntimeError(f"service '{name}' has no method '{method}'")
