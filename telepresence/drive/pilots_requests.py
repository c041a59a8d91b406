"""What a pilot asks of a drive server: repeated until it is answered. A stop outlives the server that it was asked of.
No sockets, no clock.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

from telepresence.drive.datagram import Report

STANDS = ("stopped", "fault")
"""States in which nothing that was asked for moves the robot."""


class Done(NamedTuple):
    """The answer to a request: whether it was done, and a sentence."""

    ok: bool
    text: str


class PilotsRequests:
    """Requests of one pilot; any thread may call.

    Args:
        name: Name under which the robot knows the pilot.
    """

    def __init__(self, name: str) -> None:
        self._by = f"{name} at "
        self._answered = threading.Condition()
        self._number = 0
        self._waiting: dict[int, str] = {}
        self._answers: dict[int, Done] = {}
        self._stopped = False
        """A stop of this pilot was done, and nobody has reset it since."""
        self._again: int | None = None
        """The number of a stop that is asked of the next server."""
        self._server: float | None = None
        """When the server that was last heard of began."""

    def ask(self, what: str, timeout: float) -> Done | None:
        """Wait for what became of one of `datagram.REQUESTS`; None when no answer came within `timeout` seconds, or a
        stop was asked for after a reset."""
        with self._answered:
            if what == "reset stop" and self._again is not None:
                self._waiting.pop(self._again)
                self._again = None
            if what == "stop":  # an older reset that is repeated until it is answered must not follow it
                for older in [number for number, other in self._waiting.items() if other == "reset stop"]:
                    del self._waiting[older]
                self._answered.notify_all()
            number = self._add(what)
            self._answered.wait_for(lambda: number in self._answers or number not in self._waiting, timeout)
            self._waiting.pop(number, None)
            return self._answers.pop(number, None)

    def waiting(self) -> list[tuple[int, str]]:
        """What has not been answered yet, by number."""
        with self._answered:
            return [(number, what) for number, what in self._waiting.items() if number not in self._answers]

    def answer(self, number: int, done: Done) -> None:
        """Take an answer; one that nobody waits for is dropped."""
        with self._answered:
            what = self._waiting.get(number)
            if what is None or number in self._answers:
                return
            if done.ok and what in ("stop", "reset stop"):
                self._stopped = what == "stop"
            if number == self._again:
                del self._waiting[number]
                self._again = None
                return
            self._answers[number] = done
            self._answered.notify_all()

    def report(self, report: Report) -> None:
        """Take a report. A server that has been started since knows nothing of a stop: it is asked for it."""
        with self._answered:
            first, another = self._server is None, self._server not in (None, report.started)
            self._server = report.started
            if first and report.state == "stopped" and self._by in report.reason:
                self._stopped = True  # asked for by the program whose place we have taken
            if not self._stopped or self._again is not None:
                return
            if another and "reset stop" not in self._waiting.values():
                self._again = self._add("stop")
            elif report.state not in STANDS:
                self._stopped = False  # somebody else has reset it

    def _add(self, what: str) -> int:
        self._number += 1
        self._waiting[self._number] = what
        return self._number
