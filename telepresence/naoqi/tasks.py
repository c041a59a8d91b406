"""Functions that run later, elsewhere or again and again. Times are in microseconds, as in the vendor's package."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from .future import Future, describe
from .log import logger
from .reactor import Timer, reactor
from .strands import submit_for
from .workers import blocking

_log = logger("periodictask")


def runAsync(callback: Callable[..., Any], *args: Any, delay: int = 0, **kwargs: Any) -> Future:
    """Run `callback(*args, **kwargs)` on a worker, after `delay` microseconds; return the future of its result.

    A cancel has an effect until it runs.
    """
    result = Future()
    if not callable(callback):
        raise TypeError(f"a callback must be callable, not {type(callback).__name__}")

    def run() -> None:
        result.set_on_cancel(None)
        if result.isFinished():
            return
        try:
            result.finish_with_value(callback(*args, **kwargs))
        except Exception as error:
            result.finish_with_error(describe(error))

    if delay <= 0:
        submit_for(callback, run)
        return result
    timer = reactor().call_later(delay / 1e6, submit_for, callback, run)

    def cancel() -> None:
        timer.cancel()
        result.finish_canceled()

    result.set_on_cancel(cancel)
    return result


class PeriodicTask:
    """Calls a function in a fixed rhythm, never twice at a time."""

    def __init__(self) -> None:
        self._callback: Callable[[], Any] | None = None
        self._period: float | None = None
        self._name = "periodic task"
        self._compensate = False
        self._lock = threading.Condition()
        self._timer: Timer | None = None
        self._running = self._stopping = False
        self._runner = 0
        self._round = 0

    def setCallback(self, callable: Callable[[], Any]) -> None:
        """Set the function. RuntimeError: it runs already."""
        self._check_stopped()
        self._callback = callable

    def setUsPeriod(self, usPeriod: int) -> None:
        """Set the time from call to call [microseconds]. RuntimeError: it is negative, or the task runs."""
        if usPeriod < 0:
            raise RuntimeError("Period cannot be negative")
        self._check_stopped()
        self._period = usPeriod / 1e6

    def setName(self, name: str) -> None:
        """Set the name that appears in messages."""
        self._name = name

    def compensateCallbackTime(self, compensate: bool) -> None:
        """Choose what the period is: from start to start (True), or from the end of one call to the next start."""
        self._compensate = compensate

    def start(self, immediate: bool = True) -> None:
        """Start, with the first call now or after one period. RuntimeError: function or period are missing."""
        if self._callback is None:
            raise RuntimeError("Periodic task cannot start without a setCallback() call first")
        if self._period is None:
            raise RuntimeError("Periodic task cannot start without a setPeriod() call first")
        with self._lock:
            if self._running:
                return
            self._running, self._stopping = True, False
            self._round += 1
            self._schedule(0.0 if immediate else self._period, self._round)

    def stop(self) -> None:
        """End it, and wait for a call that runs, unless called from that."""
        self.asyncStop()
        with self._lock, blocking():
            while self._runner and self._runner != threading.get_ident():
                self._lock.wait()

    def asyncStop(self) -> None:
        """End it without waiting for a call that runs."""
        with self._lock:
            self._running, self._stopping = False, True
            if self._timer is not None:
                self._timer.cancel()

    def isRunning(self) -> bool:
        """Whether it was started and not stopped."""
        return self._running

    def isStopping(self) -> bool:
        """Whether it was stopped."""
        return self._stopping

    def _check_stopped(self) -> None:
        if self._running:
            raise RuntimeError(f"{self._name} is running")

    def _schedule(self, seconds: float, round_: int) -> None:
        self._timer = reactor().call_later(seconds, submit_for, self._callback, self._run, round_)

    def _run(self, round_: int) -> None:
        with self._lock:
            if not self._running or self._round != round_:
                return
            self._runner = threading.get_ident()
        began = time.monotonic()
        try:
            assert self._callback is not None
            self._callback()
        except Exception as error:
            # As the vendor's: a task that fails ends.
            _log.warning("%s ends: %s", self._name, describe(error))
            with self._lock:
                self._running = False
        finally:
            with self._lock:
                self._runner = 0
                self._lock.notify_all()
                if self._running and self._round == round_:
                    assert self._period is not None
                    spent = time.monotonic() - began if self._compensate else 0.0
                    self._schedule(max(0.0, self._period - spent), round_)
