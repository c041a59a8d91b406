"""Calls that a module carries out while its caller goes on; NAOqi 1 calls that `post`.

    pCall([method, argument, ...])            -> number, as a dynamic
    __pCall(number of the method, [argument]) -> number

By its number `wait`, `isRunning` and `stop` know a call while it runs. What it returns, or why it fails, nobody hears.
Sources: types and numbers of the methods as a NAO V6 with NAOqi 2.8 describes them (lugu/qiloop,
examples/naov6/services.idl); what they do: NAOqi 2.8 documentation, ALModule. That does not say what pCall takes: here
it is what `post` of NAOqi's Python SDK makes of a call.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import itertools
import logging
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pepper_sim.naoqi.service import Binding, ServiceError, chosen, shown
from telepresence.naoqi.reactor import reactor

log = logging.getLogger(__name__)

MOST = 256
"""Calls of one module that may run; the next one is refused."""
_POSTING = ("pCall", "__pCall")
"""They post nothing of their kind, however deep one lies in the other."""
_numbers = itertools.count(1)
"""One count for all modules: by the number of another module's call nothing is found."""


@dataclass
class _Posted:
    call: concurrent.futures.Future
    waiters: dict[concurrent.futures.Future, None] = field(default_factory=dict)


class PostedCalls:
    """The posted calls of one module.

    Args:
        methods: Its methods by the numbers that clients know.
    """

    def __init__(self, methods: Mapping[int, Binding]) -> None:
        self._methods = {number: method for number, method in methods.items() if method.name not in _POSTING}
        self._running: dict[int, _Posted] = {}
        self._lock = threading.Lock()

    def post(self, call: Any) -> int:
        """Start [method, argument, ...] and return its number. ServiceError: There is no such method."""
        if not isinstance(call, list | tuple) or not call or not isinstance(call[0], str):
            raise ServiceError(f"a call is a list of a method's name and its arguments, got {shown(call)}")
        name, arguments = call[0], call[1:]
        binding = chosen(self._methods.values(), name, arguments)
        if binding is None:
            raise ServiceError(f"there is no method '{shown(name)[1:-1]}' with {len(arguments)} arguments")
        return self._begin(binding, arguments)

    def post_by_number(self, method: int, arguments: Sequence[Any]) -> int:
        """Start the method with this number and return the call's. ServiceError: There is no such method."""
        binding = self._methods.get(method)
        if binding is None or len(binding.arguments) != len(arguments):
            raise ServiceError(f"there is no method {method} with {len(arguments)} arguments")
        return self._begin(binding, arguments)

    def is_running(self, number: int) -> bool:
        """Whether a call runs."""
        return number in self._running

    def wait(self, number: int, timeout: float = 0.0) -> concurrent.futures.Future:
        """Return a future of whether `timeout` [s] was over before the call; 0: without a time-out, so false."""
        ended: concurrent.futures.Future = concurrent.futures.Future()
        with self._lock:
            posted = self._running.get(number)
            if posted is not None:
                posted.waiters[ended] = None
        if posted is None:
            ended.set_result(False)
            return ended
        timer = reactor().call_later(timeout, _answer, ended, True) if timeout > 0.0 else None

        def over(_: concurrent.futures.Future) -> None:
            posted.waiters.pop(ended, None)
            if timer is not None:
                timer.cancel()

        ended.add_done_callback(over)
        return ended

    def stop(self, number: int) -> None:
        """End a call as its caller would by cancelling it."""
        posted = self._running.get(number)
        if posted is not None:
            posted.call.cancel()

    def _begin(self, binding: Binding, arguments: Sequence[Any]) -> int:
        if len(self._running) >= MOST:
            raise ServiceError(f"{MOST} posted calls are running already")
        number = next(_numbers)
        try:
            call = binding(*arguments)
        except ServiceError as error:
            log.info("a posted call failed: %s", error)
            return number
        if isinstance(call, concurrent.futures.Future):
            with self._lock:
                self._running[number] = _Posted(call)
            call.add_done_callback(lambda call: self._over(number, binding, call))
        return number

    def _over(self, number: int, binding: Binding, call: concurrent.futures.Future) -> None:
        with self._lock:
            waiters = list(self._running.pop(number).waiters)
        if not call.cancelled() and (error := call.exception()) is not None:
            log.info("a posted call failed: %s", binding.explain(error))
        for ended in waiters:
            _answer(ended, False)


def _answer(ended: concurrent.futures.Future, timed_out: bool) -> None:
    with contextlib.suppress(concurrent.futures.InvalidStateError):  # the other one was first, or nobody waits
        ended.set_result(timed_out)
