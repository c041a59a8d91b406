"""The one I/O thread of a process: waits for sockets and timers, reads, and never runs the code of a user.

It starts with its first use and is a daemon; without sockets it sleeps. A forked child starts its own.
"""

from __future__ import annotations

import collections
import heapq
import itertools
import logging
import os
import selectors
import socket
import threading
import time
from typing import Any, Callable

log = logging.getLogger(__name__)

READ, WRITE = selectors.EVENT_READ, selectors.EVENT_WRITE
SCRATCH_BYTES = 256 * 1024
"""Bytes read at once. One buffer serves all connections, since only this thread reads."""

Handler = Callable[[int], None]


class Timer:
    """A call in the future; `cancel` may come from any thread."""

    __slots__ = ("arguments", "due", "function")

    def __init__(self, due: float, function: Callable[..., Any], arguments: tuple) -> None:
        self.due = due
        self.function: Callable[..., Any] | None = function
        self.arguments = arguments

    def cancel(self) -> None:
        self.function = None
        self.arguments = ()


class Reactor:
    """Runs handlers of sockets, timers and short functions on one thread, in that thread's own time.

    `call_soon`, `call_later` and `run` may be called from any thread, `call_soon` even from a finalizer: it takes no
    lock. `watch`, `change` and `unwatch` belong to the reactor's own thread.
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._wake, self._woken_by = socket.socketpair()
        self._wake.setblocking(False)
        self._woken_by.setblocking(False)
        self._selector.register(self._woken_by, READ, self._drain)
        self._soon: collections.deque[tuple[Callable[..., Any], tuple]] = collections.deque()
        self._timers: list[tuple[float, int, Timer]] = []
        self._order = itertools.count()
        self._signalled = False
        self.scratch = bytearray(SCRATCH_BYTES)
        self.scratch_view = memoryview(self.scratch)
        self._ident = 0
        self._thread = threading.Thread(target=self._run, name="naoqi-reactor", daemon=True)
        self._thread.start()

    def inside(self) -> bool:
        """Whether the caller is the reactor's thread."""
        return threading.get_ident() == self._ident

    def call_soon(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Run a short function on the reactor's thread."""
        self._soon.append((function, arguments))
        if not self._signalled and threading.get_ident() != self._ident:
            self._signalled = True
            try:
                self._wake.send(b"\0")
            except BlockingIOError:
                pass  # it is full of wake-ups already
            except OSError:
                log.debug("the reactor has ended")

    def call_later(self, seconds: float, function: Callable[..., Any], *arguments: Any) -> Timer:
        """Run a short function on the reactor's thread in `seconds`, unless the timer is cancelled."""
        timer = Timer(time.monotonic() + seconds, function, arguments)
        self.call_soon(self._add, timer)
        return timer

    def run(self, function: Callable[..., Any], *arguments: Any, timeout: float = 10.0) -> Any:
        """Run a short function on the reactor's thread and return its result, or raise what it raised.

        Raises: TimeoutError: It had no turn within `timeout` [s].
        """
        if self.inside():
            return function(*arguments)
        done = threading.Event()
        outcome: list[Any] = [None, None]

        def work() -> None:
            try:
                outcome[0] = function(*arguments)
            except BaseException as error:  # handed to the caller
                outcome[1] = error
            done.set()

        self.call_soon(work)
        if not done.wait(timeout):
            raise TimeoutError(f"the input thread did not answer within {timeout:g} s")
        if outcome[1] is not None:
            raise outcome[1]
        return outcome[0]

    def watch(self, stream: socket.socket, mask: int, handler: Handler) -> None:
        """Call `handler(ready mask)` whenever the socket is ready."""
        self._selector.register(stream, mask, handler)

    def change(self, stream: socket.socket, mask: int, handler: Handler) -> None:
        """Watch for something else; a mask of 0 pauses."""
        registered = stream in self._selector.get_map()
        if mask and registered:
            self._selector.modify(stream, mask, handler)
        elif mask:
            self._selector.register(stream, mask, handler)
        elif registered:
            self._selector.unregister(stream)

    def unwatch(self, stream: socket.socket) -> None:
        """Forget a socket, which must still be open; unknown ones are ignored."""
        try:
            self._selector.unregister(stream)
        except (KeyError, ValueError):
            log.debug("a socket was not watched")

    def forget(self) -> None:
        """Close this process's copies after a fork: the thread lives in the parent only."""
        self._selector.close()
        self._wake.close()
        self._woken_by.close()

    def _add(self, timer: Timer) -> None:
        heapq.heappush(self._timers, (timer.due, next(self._order), timer))

    def _drain(self, _mask: int) -> None:
        try:
            self._woken_by.recv(4096)
        except BlockingIOError:
            log.debug("woken without a byte")
        self._signalled = False  # after reading: a byte sent in between would be lost, and with it all later ones

    def _run(self) -> None:
        self._ident = threading.get_ident()
        while True:
            timeout = None
            if self._soon:
                timeout = 0.0
            elif self._timers:
                timeout = max(0.0, self._timers[0][0] - time.monotonic())
            for key, mask in self._selector.select(timeout):
                self._safely(key.data, mask)
            for _ in range(len(self._soon)):
                function, arguments = self._soon.popleft()
                self._safely(function, *arguments)
            while self._timers and (self._timers[0][0] <= time.monotonic() or self._timers[0][2].function is None):
                timer = heapq.heappop(self._timers)[2]
                if timer.function is not None:
                    self._safely(timer.function, *timer.arguments)

    @staticmethod
    def _safely(function: Callable[..., Any], *arguments: Any) -> None:
        try:
            function(*arguments)
        except Exception:
            log.exception("an input handler failed")  # a defect of ours; the other connections go on


_reactor: Reactor | None = None
_starting = threading.Lock()


def reactor() -> Reactor:
    """Return the process's reactor, and start it if needed."""
    global _reactor
    if _reactor is None:
        with _starting:
            if _reactor is None:
                _reactor = Reactor()
    return _reactor


def _after_fork() -> None:
    global _reactor, _starting
    _starting = threading.Lock()
    if _reactor is not None:
        _reactor.forget()
        _reactor = None


os.register_at_fork(after_in_child=_after_fork)
