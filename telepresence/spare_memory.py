"""Memory that a program holds and does not use goes back to the system.

`env.sh` lets glibc keep what pictures leave behind, as the next one needs it 30 times a second: given back each time
and asked for anew, it takes a third longer to decode one. But what lies between small blocks that live on is kept for
ever. malloc_trim(3) gives it back, in about a millisecond; the pages that are needed come again with the next picture.
"""

from __future__ import annotations

import ctypes
import threading

PERIOD = 60.0
"""Seconds between two returns."""


class SpareMemory:
    """Returns it every `period` seconds until closed, from a thread of its own."""

    def __init__(self, period: float = PERIOD) -> None:
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(period,), name="spare-memory", daemon=True)
        self._thread.start()

    def _run(self, period: float) -> None:
        trim = ctypes.CDLL(None).malloc_trim
        while not self._stop.wait(period):
            trim(0)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
