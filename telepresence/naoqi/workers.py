"""The threads that run the code of users: calls that arrive, handlers of events, callbacks.

A few threads are enough as long as each task ends soon. Two rules keep tasks that wait from stopping all others:

* A worker that waits for a future of this package (`blocking`) does not count: another one takes its place. A method
  that calls its caller back, while the caller lives in this very process and needs a worker too, cannot lock up.
* If no task has been begun for 20 ms although some are waiting, workers are added, whatever the busy ones wait for.

There are never more than 256. If all of them wait for tasks that are not begun, these begin when the first wait ends;
so a method that waits without a time limit for a service behind the same pool can hold it up, but only after 256.
"""

from __future__ import annotations

import collections
import logging
import os
import queue
import threading
from typing import Any, Callable

from .reactor import reactor

log = logging.getLogger(__name__)

FEW = 4
"""Workers that start without waiting."""
MOST = 256
STUCK_S = 0.02
"""Time without a task begun after which more workers start [s]."""
IDLE_S = 2.0
"""A worker without a task ends after this time [s]."""

_this = threading.local()


class Workers:
    """A bounded pool of daemon threads that grows when it is stuck and shrinks when it is idle."""

    def __init__(self) -> None:
        self._tasks: queue.SimpleQueue = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._threads = self._idle = self._waiting = self._blocked = self._begun = 0
        self._watched = False

    def submit(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Run a function on a worker. What it raises is logged."""
        with self._lock:
            self._waiting += 1
            start, watch = self._need()
        self._tasks.put((function, arguments))
        self._act(start, watch)

    def enter_wait(self) -> None:
        """The calling worker is about to wait."""
        with self._lock:
            self._blocked += 1
            start, watch = self._need()
        self._act(start, watch)

    def leave_wait(self) -> None:
        with self._lock:
            self._blocked -= 1

    def _need(self) -> tuple[int, bool]:
        """Return how many threads to start (0 or 1) and whether to look again later. The lock is held."""
        if self._waiting <= self._idle:
            return 0, False
        if self._threads - self._blocked < FEW and self._threads < MOST:
            self._threads += 1
            return 1, False
        watch = not self._watched
        self._watched = True
        return 0, watch

    def _act(self, start: int, watch: bool) -> None:
        for _ in range(start):
            try:
                threading.Thread(target=self._run, name="naoqi-worker", daemon=True).start()
            except RuntimeError as error:  # the system has no more, or the interpreter is ending: others do the work
                log.debug("no new worker: %s", error)
                with self._lock:
                    self._threads -= 1
        if watch:
            reactor().call_later(STUCK_S, self._look, self._begun)

    def _look(self, begun: int) -> None:
        """Add workers if nothing was begun since the last look."""
        start = 0
        with self._lock:
            if self._waiting <= self._idle:
                self._watched = False
                return
            if self._begun == begun:
                start = max(0, min(self._waiting - self._idle, self._threads, MOST - self._threads))
                self._threads += start
        self._act(start, True)

    def _run(self) -> None:
        _this.pool = self
        while True:
            with self._lock:
                self._idle += 1
            try:
                function, arguments = self._tasks.get(timeout=IDLE_S)
            except queue.Empty:
                with self._lock:
                    self._idle -= 1
                    if self._waiting > self._idle:
                        continue  # a task was announced meanwhile
                    self._threads -= 1
                    return
            with self._lock:
                self._idle -= 1
                self._waiting -= 1
                self._begun += 1
            try:
                function(*arguments)
            except Exception:
                log.exception("a task failed")
            del function, arguments  # or the idle worker keeps them alive


class _Blocking:
    """Marks a wait; see `blocking`."""

    def __enter__(self) -> None:
        pool = getattr(_this, "pool", None)
        if pool is not None:
            pool.enter_wait()

    def __exit__(self, *_: object) -> None:
        pool = getattr(_this, "pool", None)
        if pool is not None:
            pool.leave_wait()


_marker = _Blocking()
_pool = Workers()


def blocking() -> _Blocking:
    """Return the context manager to put around a wait: a worker that waits is replaced meanwhile."""
    return _marker


def submit(function: Callable[..., Any], *arguments: Any) -> None:
    """Run a function on a worker of the process's pool. What it raises is logged."""
    _pool.submit(function, *arguments)


def inside() -> bool:
    """Whether the caller is a worker."""
    return getattr(_this, "pool", None) is not None


class Strand:
    """Runs its tasks one at a time in order, on whatever worker is free."""

    _TURN = 16
    """Tasks in a row before others get their turn."""

    def __init__(self) -> None:
        self._tasks: collections.deque[tuple[Callable[..., Any], tuple]] = collections.deque()
        self._lock = threading.Lock()
        self._running = False

    def __len__(self) -> int:
        return len(self._tasks)

    def submit(self, function: Callable[..., Any], *arguments: Any) -> None:
        """Run a function after those submitted before. What it raises is logged."""
        with self._lock:
            self._tasks.append((function, arguments))
            if self._running:
                return
            self._running = True
        submit(self._run)

    def _run(self) -> None:
        for _ in range(self._TURN):
            with self._lock:
                if not self._tasks:
                    self._running = False
                    return
                function, arguments = self._tasks.popleft()
            try:
                function(*arguments)
            except Exception:
                log.exception("a task failed")
        submit(self._run)


def _after_fork() -> None:
    global _pool
    _pool = Workers()
    _this.__dict__.clear()


os.register_at_fork(after_in_child=_after_fork)
