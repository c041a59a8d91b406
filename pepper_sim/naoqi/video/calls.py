"""The calls that wait for pictures of one subscription: one after the other, each gets a picture of its own.

A client that asks and does not read what comes holds up itself: its calls take one thread, however many there are.
"""

from __future__ import annotations

import collections
import concurrent.futures
import threading
from collections.abc import Callable
from typing import Any

from pepper_sim.naoqi.service import ServiceError


class PictureCalls:
    """Runs calls in their order, on a pool that it shares with others.

    Args:
        most: So many may wait; the next one is refused.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._waiting: collections.deque[tuple[concurrent.futures.Future, Callable[[], Any]]] = collections.deque()
        self._running = False

    def run(self, pool: concurrent.futures.Executor, work: Callable[[], Any]) -> concurrent.futures.Future:
        """Return the future of what `work` returns when its turn has come.

        Raises: ServiceError: Too many are waiting.
        """
        future: concurrent.futures.Future = concurrent.futures.Future()
        with self._lock:
            if len(self._waiting) >= self._most:
                raise ServiceError(f"{self._most} calls wait for pictures of this subscription already")
            self._waiting.append((future, work))
            start, self._running = not self._running, True
        if start:
            pool.submit(self._run)
        return future

    def close(self) -> None:
        """End what waits, without a picture: the subscription has ended."""
        with self._lock:
            waiting, self._waiting = self._waiting, collections.deque()
        for future, _ in waiting:
            if future.set_running_or_notify_cancel():
                future.set_result(None)

    def _run(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._running = False
                    return
                future, work = self._waiting.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(work())
            except Exception as error:  # top of a remote call: the client gets every error as text
                future.set_exception(error)
