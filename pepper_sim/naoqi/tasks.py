"""Long calls: threads that run them, and futures that end at a given time or when a condition holds."""

from __future__ import annotations

import concurrent.futures
import heapq
import itertools
import math
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from pepper_sim.body.joints import resolve

MAX_WORKERS = 256
"""A thread is started when no other is idle."""


class Workers:
    """Threads for calls that wait. A worker waits on `closing` instead of sleeping."""

    def __init__(self) -> None:
        self.closing = threading.Event()
        self._pool = concurrent.futures.ThreadPoolExecutor(MAX_WORKERS, thread_name_prefix="naoqi-task")

    def run(self, work: Callable[..., Any], *arguments: Any) -> concurrent.futures.Future:
        """Run `work(*arguments)` on another thread."""
        return self._pool.submit(work, *arguments)

    def wait_until(self, condition: Callable[[], bool], timeout: float = 3600.0, period: float = 0.02) -> bool:
        """Block the calling worker until `condition()`; false if `timeout` [s] or the server's end comes first."""
        for _ in range(max(1, round(timeout / period))):
            if condition():
                return True
            if self.closing.wait(period):
                return False
        return condition()

    def close(self) -> None:
        self.closing.set()
        self._pool.shutdown(wait=False, cancel_futures=True)


class Alarm:
    """Completes futures at given times, with one thread for all of them."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._due: list[tuple[float, int, concurrent.futures.Future]] = []
        self._numbers = itertools.count()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="alarm", daemon=True)
        self._thread.start()

    def after(self, delay: float) -> concurrent.futures.Future:
        """Return a future that is done (None) after `delay` seconds, or at `close`; it can be cancelled earlier."""
        future: concurrent.futures.Future = concurrent.futures.Future()
        with self._changed:
            if self._closed or delay <= 0.0:
                future.set_result(None)
                return future
            heapq.heappush(self._due, (time.monotonic() + delay, next(self._numbers), future))
            self._changed.notify()
        return future

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                wait = self._due[0][0] - time.monotonic() if self._due else None
                if wait is None or wait > 0.0:
                    self._changed.wait(wait)
                now = float("inf") if self._closed else time.monotonic()
                over = []
                while self._due and self._due[0][0] <= now:
                    over.append(heapq.heappop(self._due)[2])
                closed = self._closed
            for future in over:
                if future.set_running_or_notify_cancel():
                    future.set_result(None)
            if closed:
                return


class Watch:
    """Completes futures when conditions hold, with one thread for all of them."""

    PERIOD = 0.02

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._conditions: list[tuple[Callable[[], bool], float, concurrent.futures.Future]] = []
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)
        self._thread.start()

    def until(self, condition: Callable[[], bool], timeout: float = math.inf) -> concurrent.futures.Future:
        """Return a future that is true once `condition()`, false after `timeout` [s] or at `close`."""
        future: concurrent.futures.Future = concurrent.futures.Future()
        with self._changed:
            if self._closed:
                future.set_result(False)
                return future
            self._conditions.append((condition, time.monotonic() + timeout, future))
            self._changed.notify()
        return future

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                if not self._closed:
                    self._changed.wait(self.PERIOD if self._conditions else None)
                closed, watched, self._conditions = self._closed, self._conditions, []
            for condition, deadline, future in watched:
                holds = condition()
                if holds or closed or future.cancelled() or time.monotonic() >= deadline:
                    resolve(future, holds)
                else:
                    with self._changed:
                        self._conditions.append((condition, deadline, future))
            if closed:
                return


def chained(future: concurrent.futures.Future, answer: Callable[[Any], Any]) -> concurrent.futures.Future:
    """Return a future that ends with `answer(result of future)`; cancelling it cancels `future`."""
    after: concurrent.futures.Future = concurrent.futures.Future()

    def finish(done: concurrent.futures.Future) -> None:
        if after.cancelled() or not after.set_running_or_notify_cancel():
            return
        if done.cancelled():
            after.set_result(answer(False))
        elif done.exception() is not None:
            after.set_exception(done.exception())
        else:
            after.set_result(answer(done.result()))

    future.add_done_callback(finish)
    after.add_done_callback(lambda done: future.cancel() if done.cancelled() else None)
    return after


def all_ended(
    futures: Sequence[concurrent.futures.Future], answer: concurrent.futures.Future
) -> concurrent.futures.Future:
    """Return a future that ends once all `futures` have, with the result of `answer`, one of them; false if that was
    cancelled. Cancelling it cancels them all."""
    after: concurrent.futures.Future = concurrent.futures.Future()
    running, lock = set(futures), threading.Lock()

    def ended(future: concurrent.futures.Future) -> None:
        with lock:
            running.discard(future)
            last = not running
        if last:
            resolve(after, not answer.cancelled() and answer.result())

    def end(done: concurrent.futures.Future) -> None:
        if done.cancelled():
            for future in futures:
                future.cancel()

    after.add_done_callback(end)
    for future in futures:
        future.add_done_callback(ended)
    return after
