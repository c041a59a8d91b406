"""A terminal with nobody in front of it, for tests of keyboard programs; needs no ROS."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import subprocess
import termios
import threading
from typing import Any

from telepresence.station import processes


class Terminal:
    """A program in a new terminal, as its controlling one: what a person types and sees there.

    Args:
        argv: The program.
        popen: Further arguments of `subprocess.Popen`, such as the environment.
    """

    def __init__(self, *argv: str, **popen: Any) -> None:
        self.master, self.slave = pty.openpty()
        self.seen = ""
        self.process = subprocess.Popen(
            argv,
            stdin=self.slave,
            stdout=self.slave,
            stderr=self.slave,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
            **popen,
        )
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="terminal-reader", daemon=True)
        self._reader.start()

    def type(self, text: str) -> None:
        """Press these keys."""
        os.write(self.master, text.encode())

    def pause(self) -> None:
        """Press Ctrl-S: whoever prints waits."""
        self.type("\x13")

    def resume(self) -> None:
        """Press Ctrl-Q."""
        self.type("\x11")

    def echoes(self) -> bool:
        """Whether the terminal shows what is typed."""
        return bool(termios.tcgetattr(self.slave)[3] & termios.ECHO)

    def takes_lines(self) -> bool:
        """Whether programs get whole lines, not keys."""
        return bool(termios.tcgetattr(self.slave)[3] & termios.ICANON)

    def hang_up(self) -> None:
        """Close the terminal's window."""
        self._closing.set()
        self._reader.join(timeout=5.0)  # the kernel keeps the terminal open as long as anybody reads
        for descriptor in (self.slave, self.master):
            if descriptor >= 0:
                os.close(descriptor)
        self.slave = self.master = -1

    def close(self) -> None:
        """Close the window and wait for the program's end."""
        self.hang_up()
        processes.end(self.process, patience=10.0)

    def _read(self) -> None:
        while not self._closing.is_set():
            if select.select([self.master], [], [], 0.05)[0]:
                self.seen += os.read(self.master, 4096).decode(errors="replace")
