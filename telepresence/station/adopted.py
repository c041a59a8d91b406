"""A running program that is not our child, as who started it is gone; used like `subprocess.Popen`. Standard library
only.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess

UNKNOWN = 256
"""Exit code of a program that ended and was not our child; no program's own."""


class Adopted:
    """A running program.

    Args:
        pid: Its process id.
    Raises:
        ProcessLookupError: It has ended.
    """

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._descriptor = os.pidfd_open(pid)

    def poll(self) -> int | None:
        """None while it runs."""
        return UNKNOWN if is_readable(self._descriptor) else None

    def wait(self, timeout: float | None = None) -> int:
        """Return when it has ended.

        Raises:
            subprocess.TimeoutExpired: It has not, in `timeout` seconds.
        """
        if not is_readable(self._descriptor, timeout):
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return UNKNOWN

    def send_signal(self, request: int) -> None:
        """Send it a signal, unless it has ended."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._descriptor, request)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def __del__(self) -> None:
        if hasattr(self, "_descriptor"):
            os.close(self._descriptor)


def is_readable(descriptor: int, timeout: float | None = 0.0) -> bool:
    """Whether something can be read there within `timeout` seconds (None: for ever); of a pidfd: whether its process
    has ended."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(None if timeout is None else timeout * 1000.0))
