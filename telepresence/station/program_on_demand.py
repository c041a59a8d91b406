"""A program that starts when somebody connects to its port, and that starts again from then on when it dies."""

from __future__ import annotations

import select
import socket
import subprocess
from collections.abc import Callable

from telepresence.station.adopted import Adopted
from telepresence.station.kept_program import KeptProgram, Report


class ProgramOnDemand:
    """Takes care of a port until somebody connects to it, who then waits until the program has started.

    Args:
        name: Of the program, in faults.
        listening: The socket; `close` closes it.
        start: Starts the program at the head of a process group; it must inherit the socket.
        report: Gets each fault.
    """

    def __init__(
        self, name: str, listening: socket.socket, start: Callable[[], subprocess.Popen | Adopted], report: Report
    ) -> None:
        self._name, self._listening, self._start, self._report = name, listening, start, report
        self._program: KeptProgram | None = None
        self._visitors = select.poll()
        self._visitors.register(listening, select.POLLIN)

    @property
    def pid(self) -> int:
        """Process id of the newest start; 0 before the first."""
        return self._program.pid if self._program is not None else 0

    def poll(self, elapsed: float) -> None:
        """Look once.

        Args:
            elapsed: Seconds since the last look.
        """
        if self._program is not None:
            self._program.poll(elapsed)
        elif self._visitors.poll(0):
            self._program = KeptProgram(self._name, self._start, self._report)

    def close(self, patience: float) -> None:
        """End it; `patience` seconds after each signal."""
        self._listening.close()
        if self._program is not None:
            self._program.close(patience)
