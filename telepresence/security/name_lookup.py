"""Looks a host's name up within a given time. The system's own look-up cannot be told to hurry: with a name server that
does not answer it takes five seconds and more, in which a robot would get no velocity."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

Addresses = list[tuple[Any, ...]]
"""As `socket.getaddrinfo` returns them: family, type, protocol, name, address."""

BELIEVED = 30.0
"""Seconds after which an answer is asked for anew; the old one counts as long as no other comes in time."""


class NameLookup:
    """The addresses of one host; for one thread, besides its own, which lives as long as a look-up does.

    Args:
        host, port: A name or an address, and a TCP port.
        clock: Monotonic time [s].
    """

    def __init__(self, host: str, port: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._host, self._port, self._clock = host, port, clock
        self._known: Addresses = []
        self._asked_at = -math.inf
        self._running: _Question | None = None

    def addresses(self, timeout: float) -> Addresses:
        """Return the addresses within `timeout` seconds.

        Raises:
            TimeoutError: No answer in time, and none is known from before.
            OSError: The name is unknown, or is none.
        """
        if self._known and self._clock() - self._asked_at < BELIEVED:
            return self._known
        if self._running is None:
            self._running = _Question(self._host, self._port)
        question = self._running
        if not question.answered.wait(timeout):
            if self._known:
                return self._known
            raise TimeoutError(f"{self._host} was not looked up in time")
        self._running = None
        if question.failure is not None:
            raise question.failure
        self._known, self._asked_at = question.found, self._clock()
        return self._known

    def doubt(self) -> None:
        """Nobody could be reached there: ask anew next time."""
        self._asked_at = -math.inf


class _Question:
    def __init__(self, host: str, port: int) -> None:
        self._host, self._port = host, port
        self.answered = threading.Event()
        self.found: Addresses = []
        self.failure: OSError | None = None
        try:  # an address needs no name server, and so no thread
            self._ask(socket.AI_NUMERICHOST)
        except (OSError, UnicodeError):
            threading.Thread(target=self._run, name="name look-up", daemon=True).start()

    def _ask(self, flags: int = 0) -> None:
        self.found = list(socket.getaddrinfo(self._host, self._port, type=socket.SOCK_STREAM, flags=flags))
        self.answered.set()

    def _run(self) -> None:
        try:
            self._ask()
        except OSError as error:
            self.failure = error
        except UnicodeError:  # of a name with two dots in a row, for example
            self.failure = OSError(f"{self._host!r} is no address")
        self.answered.set()
