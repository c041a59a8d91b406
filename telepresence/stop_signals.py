"""Signals that end a program by an event, without hanging it."""

from __future__ import annotations

import signal
import threading
from types import FrameType


def stop_on(stop: threading.Event, *numbers: signal.Signals) -> None:
    """Let these signals set `stop` and do nothing else, but for those that `heeded` leaves out. Call it on the main
    thread, where Python runs the handlers."""

    def request_stop(_signal: int, _frame: FrameType | None) -> None:
        # Not in this thread: it may be inside stop.wait() and hold the lock that set() needs; both would wait for ever.
        threading.Thread(target=stop.set, name="stop", daemon=True).start()

    for number in heeded(*numbers):
        signal.signal(number, request_stop)


def heeded(*numbers: signal.Signals) -> list[signal.Signals]:
    """Return these signals without SIGHUP when whoever started this program wants it ignored, as nohup(1) does: then it
    goes on when its terminal is closed."""
    ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return [number for number in numbers if not (ignored and number is signal.SIGHUP)]
