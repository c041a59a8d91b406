"""Futures and promises with the interface of the vendor's package, whose times are in milliseconds."""

from __future__ import annotations

import enum
import sys
import threading
import weakref
from collections.abc import Callable, Iterable
from typing import Any

from .log import logger
from .strands import submit_for
from .workers import blocking

_log = logger("future")

FutureState = enum.IntEnum(
    "FutureState", {"None": 0, "Running": 1, "Canceled": 2, "FinishedWithError": 3, "FinishedWithValue": 4}
)
FutureTimeout = enum.IntEnum("FutureTimeout", {"None": 0, "Infinite": 2147483647})

_RUNNING, _CANCELED, _ERROR, _VALUE = 1, 2, 3, 4
_STATES = {int(state): state for state in FutureState}
_UNSET: Any = object()
INFINITE = 2147483647

TIMEOUT_TEXT = "Future timeout."
CANCELED_TEXT = "Future canceled."
ALREADY_SET_TEXT = "Future has already been set."
BROKEN_TEXT = "Promise broken (all promises are destroyed)"


class Future:
    """A value that may still be on its way.

    `Future(value)` has its value. `Future()` is completed by whoever made it, through `finish_with_value`,
    `finish_with_error` or `finish_canceled`; `on_cancel` is called when a cancel is asked for. With `decode` the value
    is given as it came and decoded once, by the first thread that asks for it, never by the one that reads the network.
    """

    __slots__ = (
        "__weakref__",
        "_callbacks",
        "_cancel_requested",
        "_decode",
        "_direct",
        "_lock",
        "_on_cancel",
        "_result",
        "_state",
        "_waiters",
    )

    def __init__(
        self,
        value: Any = _UNSET,
        *,
        decode: Callable[[Any], Any] | None = None,
        on_cancel: Callable[[], Any] | None = None,
    ) -> None:
        self._lock = threading.Lock()
        self._result = value
        self._state = _RUNNING if value is _UNSET else _VALUE
        self._decode = decode
        self._on_cancel = on_cancel
        self._cancel_requested = False
        self._waiters: list[threading.Lock] = []
        self._callbacks: list[Callable[[Future], Any]] = []
        self._direct: list[Callable[[Future], Any]] = []

    # What completes it. True: this call did it; False: it was complete.

    def _finish(self, state: int, result: Any, decode: Callable[[Any], Any] | None = None) -> bool:
        with self._lock:
            if self._state != _RUNNING:
                return False
            self._result = result
            self._state = state
            self._on_cancel = None
            if decode is not None:
                self._decode = decode
            waiters = self._waiters
            callbacks = self._callbacks
            direct = self._direct
            self._waiters = []
            self._callbacks = []
            self._direct = []
        for waiter in waiters:
            waiter.release()
        for callback in direct:
            callback(self)
        for callback in callbacks:
            submit_for(callback, _run_callback, callback, self)
        return True

    def finish_with_value(self, value: Any) -> bool:
        """Complete with a value (the payload, if there is a decoder). Return False if it was complete."""
        return self._finish(_VALUE, value)

    def finish_with_error(self, error: str | RuntimeError) -> bool:
        """Complete with an error: its text, or the RuntimeError that `value()` shall raise."""
        return self._finish(_ERROR, error)

    def finish_canceled(self) -> bool:
        """Complete as cancelled."""
        return self._finish(_CANCELED, None)

    def set_on_cancel(self, on_cancel: Callable[[], Any] | None) -> None:
        """Set what `cancel` calls from now on."""
        with self._lock:
            if self._state == _RUNNING:
                self._on_cancel = on_cancel

    # What waits for it.

    def _wait(self, timeout_ms: float) -> int:
        """Wait at most so long (ms); return the state, after decoding."""
        if self._state == _RUNNING:
            waiter = threading.Lock()
            waiter.acquire()
            with self._lock:
                if running := self._state == _RUNNING:
                    self._waiters.append(waiter)
            if running:
                seconds = -1.0 if timeout_ms >= INFINITE else max(timeout_ms, 0.0) / 1000.0
                with blocking():
                    in_time = waiter.acquire(True, seconds)
                if not in_time:
                    with self._lock:
                        if self._state == _RUNNING:
                            self._waiters.remove(waiter)
                            return _RUNNING
        if self._decode is not None:
            self._decode_now()
        return self._state

    def _decode_now(self) -> None:
        with self._lock:
            decode, self._decode = self._decode, None
            if decode is None or self._state != _VALUE:
                return
            try:
                self._result = decode(self._result)
            except Exception as error:
                self._state = _ERROR
                self._result = error if isinstance(error, RuntimeError) else describe(error)

    def _finished(self, timeout_ms: float) -> int:
        state = self._wait(timeout_ms)
        if state == _RUNNING:
            raise RuntimeError(TIMEOUT_TEXT)
        return state

    def value(self, timeout: float = INFINITE) -> Any:
        """Wait at most `timeout` ms and return the value. RuntimeError: the error, a cancel, or the time is over."""
        state = self._finished(timeout)
        if state == _VALUE:
            return self._result
        if state == _CANCELED:
            raise RuntimeError(CANCELED_TEXT)
        if isinstance(self._result, RuntimeError):
            raise self._result.with_traceback(None)
        raise RuntimeError(str(self._result))

    def error(self, timeout: float = INFINITE) -> str:
        """Wait at most `timeout` ms and return the error's text. RuntimeError: there is none, or the time is over."""
        if self._finished(timeout) != _ERROR:
            raise RuntimeError("Future has no error.")
        return str(self._result)

    def wait(self, timeout: float = INFINITE) -> FutureState:  # type: ignore[valid-type]
        """Wait at most `timeout` ms and return the state, `FutureState.Running` if it is not over."""
        return _STATES[self._wait(timeout)]

    def hasValue(self, timeout: float = INFINITE) -> bool:
        """Wait as `value` does and tell whether there is a value."""
        return self._finished(timeout) == _VALUE

    def hasError(self, timeout: float = INFINITE) -> bool:
        """Wait as `value` does and tell whether there is an error."""
        return self._finished(timeout) == _ERROR

    def isFinished(self) -> bool:
        """Whether a value, an error or a cancel has come."""
        return self._state != _RUNNING

    def isRunning(self) -> bool:
        """Whether nothing has come yet."""
        return self._state == _RUNNING

    def isCanceled(self) -> bool:
        """Whether it ended by a cancel."""
        return self._state == _CANCELED

    def isCancelable(self) -> bool:
        """Whether `cancel` may be called: always, though it need not have an effect."""
        return True

    @property
    def cancel_requested(self) -> bool:
        """Whether `cancel` was called while it was running."""
        return self._cancel_requested

    def cancel(self) -> None:
        """Ask for a cancel. The future ends when the other side agrees, and that may be with a value."""
        with self._lock:
            if self._state != _RUNNING:
                return
            self._cancel_requested = True
            on_cancel = self._on_cancel
        if on_cancel is not None:
            try:
                on_cancel()
            except Exception as error:
                _log.warning("Promise `onCancel` callback threw an exception: %s", describe(error))

    # What follows it.

    def addCallback(self, callback: Callable[[Future], Any]) -> None:
        """Call `callback(future)` on a thread of the pool when this is complete."""
        if not callable(callback):
            raise TypeError(f"a callback must be callable, not {type(callback).__name__}")
        with self._lock:
            if self._state == _RUNNING:
                self._callbacks.append(callback)
                return
        submit_for(callback, _run_callback, callback, self)

    def when_done(self, callback: Callable[[Future], Any]) -> None:
        """Call `callback(future)` in the thread that completes this, or now: for short functions of this package."""
        with self._lock:
            if self._state == _RUNNING:
                self._direct.append(callback)
                return
        callback(self)

    def _chain(self, step: Callable[[Future, Future], Any], callback: Callable[..., Any] | None = None) -> Future:
        result = Future(on_cancel=self.cancel)

        def run(finished: Future) -> None:
            try:
                step(finished, result)
            except Exception as error:
                result.finish_with_error(describe(error))

        self.when_done(lambda _: submit_for(callback or run, run, self))
        return result

    def then(self, callback: Callable[[Future], Any]) -> Future:
        """Return a future of `callback(this future)`, called when this one is complete, whatever came."""
        return self._chain(lambda finished, result: result.finish_with_value(callback(finished)), callback)

    def andThen(self, callback: Callable[[Any], Any]) -> Future:
        """Return a future of `callback(value)`. An error or a cancel of this one goes on to it instead."""

        def step(finished: Future, result: Future) -> None:
            if finished._wait(INFINITE) == _VALUE:
                result.finish_with_value(callback(finished._result))
            else:
                forward(finished, result)

        return self._chain(step, callback)

    def unwrap(self) -> Future:
        """Return the future inside: of a future whose value is a future, one with that one's value."""
        if self._state == _VALUE and not isinstance(self.value(), Future):
            raise RuntimeError(f"Unwrapping something that is not a nested future: {type(self._result).__name__}")

        def step(finished: Future, result: Future) -> None:
            if finished._wait(INFINITE) != _VALUE:
                forward(finished, result)
            elif isinstance(finished._result, Future):
                inner = finished._result
                result.set_on_cancel(inner.cancel)
                inner.addCallback(lambda done: forward(done, result))
            else:
                result.finish_with_error(
                    f"Unwrapping something that is not a nested future: {type(finished._result).__name__}"
                )

        return self._chain(step)


class Promise:
    """The writing end of a future. `on_cancel(promise)` is called by the thread that cancels the future."""

    def __init__(self, on_cancel: Callable[[Promise], Any] | None = None) -> None:
        self._future = Future()
        if on_cancel is not None:
            me = weakref.ref(self)  # the future must not keep its promise, whose end is told to those who wait

            def cancel() -> None:
                if (promise := me()) is not None:
                    on_cancel(promise)

            self._future.set_on_cancel(cancel)

    def __del__(self) -> None:
        future = getattr(self, "_future", None)
        if future is not None and future._state == _RUNNING and not sys.is_finalizing():
            future.finish_with_error(BROKEN_TEXT)

    def future(self) -> Future:
        """Return the future, the same one each time."""
        return self._future

    def setValue(self, value: Any) -> None:
        """Complete the future with a value. RuntimeError: it is complete."""
        _check(self._future.finish_with_value(value))

    def setError(self, error: str) -> None:
        """Complete the future with an error text. RuntimeError: it is complete."""
        _check(self._future.finish_with_error(str(error)))

    def setCanceled(self) -> None:
        """Complete the future as cancelled. RuntimeError: it is complete."""
        _check(self._future.finish_canceled())

    def isCancelRequested(self) -> bool:
        """Whether the future's holder asked for a cancel."""
        return self._future.cancel_requested


def _run_callback(callback: Callable[[Future], Any], future: Future) -> None:
    try:
        callback(future)
    except Exception as error:
        _log.warning("Exception in a callback of a future: %s", describe(error))


def _check(done: bool) -> None:
    if not done:
        raise RuntimeError(ALREADY_SET_TEXT)


def failed(error: str | RuntimeError) -> Future:
    """Return a future that has failed."""
    future = Future()
    future.finish_with_error(error)
    return future


def describe(error: BaseException) -> str:
    """Return an exception as one text, "ZeroDivisionError: division by zero", as the vendor's package begins it."""
    text = str(error)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def forward(finished: Future, result: Future) -> None:
    """Complete `result` with what a finished future holds."""
    state = finished._wait(INFINITE)
    if state == _VALUE:
        result.finish_with_value(finished._result)
    elif state == _CANCELED:
        result.finish_canceled()
    else:
        result.finish_with_error(finished._result)


def futureBarrier(futures: Iterable[Future]) -> Future:
    """Return a future of the list of the given futures, complete when all of them are, whatever came."""
    waited = list(futures)

    def cancel() -> None:
        for future in waited:
            future.cancel()

    barrier = Future(on_cancel=cancel)
    lock = threading.Lock()
    left = len(waited)

    def one_done(_: Future) -> None:
        nonlocal left
        with lock:
            left -= 1
            last = left == 0
        if last:
            barrier.finish_with_value(waited)

    if not waited:
        barrier.finish_with_value(waited)
    for future in waited:
        future.addCallback(one_done)
    return barrier
