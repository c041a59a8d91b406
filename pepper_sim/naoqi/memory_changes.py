"""Waiting for the next change of an ALMemory key, whatever writes it."""

from __future__ import annotations

import concurrent.futures
import threading
from collections.abc import Callable
from typing import Any

PERIOD = 0.02
"""Seconds between two looks; the body's keys change as often."""


class Changes:
    """Looks at the keys that somebody waits for, on a thread that lives as long as anybody does.

    Args:
        read: Returns the value of a key.
    """

    def __init__(self, read: Callable[[str], Any]) -> None:
        self._read = read
        self._lock = threading.Lock()
        self._waiting: list[tuple[concurrent.futures.Future, str, Any]] = []
        self._closing = threading.Event()

    def next(self, key: str) -> concurrent.futures.Future:
        """Return a future that ends with the key's value when that is another one than now; it can be cancelled."""
        future: concurrent.futures.Future = concurrent.futures.Future()
        with self._lock:
            alone = not self._waiting
            self._waiting.append((future, key, self._read(key)))
        if alone:
            threading.Thread(target=self._run, name="memory-changes", daemon=True).start()
        return future

    def close(self) -> None:
        """Cancel what still waits."""
        self._closing.set()
        with self._lock:
            waiting, self._waiting = self._waiting, []
        for future, _, _ in waiting:
            future.cancel()

    def _run(self) -> None:
        while not self._closing.wait(PERIOD):
            with self._lock:
                self._waiting = [entry for entry in self._waiting if not entry[0].cancelled()]
                changed = [(entry, value) for entry in self._waiting if (value := self._read(entry[1])) != entry[2]]
                for entry, _ in changed:
                    self._waiting.remove(entry)
                done = not self._waiting
            for (future, _, _), value in changed:
                if future.set_running_or_notify_cancel():
                    future.set_result(value)
            if done:
                return
