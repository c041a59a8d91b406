"""Signals that end a program by an event, without hanging it."""

from __future__ import annotations

import signal
import threading
from types import FrameType


def stop_on(stop: threading.Event, *numbers: signal.Signals) -> None:
    """Let these signals set `stop` and do nothing else. Call it on the main thread, where Python runs the handlers."""

    def request_stop(_signal: int, _frame: FrameType | None) -> None:
        # Not in this thread: it may be inside stop.wait() and hold the lock that set() needs; both would wait for ever.
        threading.Thread(target=stop.set, name="stop", daemon=True).start()

    for number in numbers:
        signal.signal(number, request_stop)
