"""A program of the station that starts again when it dies or freezes: roslaunch, the virtual display, its page."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import subprocess
import time
from collections.abc import Callable

from telepresence.station import processes, vitals
from telepresence.station.adopted import Adopted
from telepresence.station.restarts import LONGEST_PAUSE, Restarts, what_next
from telepresence.station.vitals import Beats, Vitals

log = logging.getLogger(__name__)

Report = Callable[[str, str, str], None]
"""Takes a fault: program, what, next; see telepresence_msgs/Fault."""


class KeptProgram:
    """Starts a program now, and again whenever `look` finds it dead or frozen.

    Args:
        name: Of the program, in faults.
        start: Starts it, at the head of a process group, or goes on with one.
        report: Gets each fault.
        beats: Where it beats; None for a program that does not.
        ended: Whether it shall stay away after this exit code (negative: the signal that ended it).
        ready: Whether this start has come so far that it does what it is for.
    """

    def __init__(
        self,
        name: str,
        start: Callable[[], subprocess.Popen | Adopted],
        report: Report,
        beats: Beats | None = None,
        ended: Callable[[int], bool] = lambda code: False,
        ready: Callable[[], bool] = lambda: True,
    ) -> None:
        self._name, self._start, self._report, self._beats, self._ended = name, start, report, beats, ended
        self._ready = ready
        self._restarts = Restarts()
        self._due: float | None = None
        self._begin()

    @property
    def pid(self) -> int:
        """Process id of the newest start."""
        return self.process.pid

    @property
    def runs(self) -> bool:
        """Whether it was alive at the last look."""
        return self._due is None

    def poll(self, elapsed: float) -> int | None:
        """Look once; the exit code when it has ended for good.

        Args:
            elapsed: Seconds since the last look.
        """
        now = time.monotonic()
        if self._due is not None:
            if now >= self._due:
                self._begin_again(now)
            return None
        what = ""
        if self._vitals.froze(elapsed):
            what = "froze"
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        code = self.process.poll()
        if code is None:
            return None
        if not what and self._ended(code):
            return code
        pause = self._restarts.died(now, self._ready())
        self._due = now + pause
        what, then = what or vitals.cause(code), what_next(pause)
        if self._restarts.worth_a_line:
            log.warning("%s %s; %s", self._name, what, then)
        self._report(self._name, what, then)
        return None

    def close(self, patience: float) -> None:
        """End it; `patience` seconds after each signal."""
        processes.end(self.process, patience)
        if self._beats is not None:
            self._beats.close()

    def _begin_again(self, now: float) -> None:
        try:
            self._begin()
        except (OSError, RuntimeError) as error:
            log.error("%s cannot be started, trying again: %s", self._name, error)
            self._due = now + LONGEST_PAUSE

    def _begin(self) -> None:
        self.process = self._start()
        self._due = None
        self._restarts.started(time.monotonic())
        self._vitals = Vitals(self.process.pid, self._beats)
