"""Prints to a terminal that may be paused, by Ctrl-S or by an ssh that stalls: whoever writes to such a terminal waits
until somebody presses Ctrl-Q, and a supervisor that waits brings nobody back."""

from __future__ import annotations

import logging
import os
import select
import sys
import threading
from collections import deque
from pathlib import Path

MOST_WAITING = 1000
"""Lines that wait for a paused terminal; of more the oldest are left out."""
COLOURS = {"[WARN]": "\33[33m", "[ERROR]": "\33[31m", "[FATAL]": "\33[31m"}
"""Level -> colour in which rosgraph.roslogging itself prints it to a terminal."""
PATIENCE = 0.5
"""Seconds that `close` waits for the terminal."""


class TerminalPrinter(logging.Handler):
    """Prints lines from a thread of its own, in their order, and in a `with` block what is logged, too.

    Args:
        folder: Where those lines are kept that the terminal does not get.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(logging.WARNING)
        self._folder = folder
        self._changed = threading.Condition()
        self._lines: deque[tuple[int, str]] = deque()
        self._left_out = 0
        self._closing = False
        sys.stdout.flush()
        sys.stderr.flush()
        self._thread = threading.Thread(target=self._run, name="terminal", daemon=True)
        self._thread.start()

    def __enter__(self) -> TerminalPrinter:
        logging.getLogger().addHandler(self)
        return self

    def __exit__(self, *_: object) -> None:
        logging.getLogger().removeHandler(self)
        self.close()

    def say(self, text: str) -> None:
        """Print to standard output; returns at once."""
        self._add(1, text)

    def warn(self, text: str) -> None:
        """Print to standard error; returns at once."""
        colour = COLOURS.get(text.partition(" ")[0]) if os.isatty(2) else None
        self._add(2, f"{colour}{text}\33[0m" if colour else text)

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record of `logging`."""
        self.warn(self.format(record))

    def close(self) -> None:
        """Wait until all is printed, if the terminal takes it."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(PATIENCE)
        super().close()

    def _add(self, descriptor: int, text: str) -> None:
        with self._changed:
            self._lines.append((descriptor, text))
            if len(self._lines) > MOST_WAITING:
                self._lines.popleft()
                self._left_out += 1
            self._changed.notify_all()

    def _run(self) -> None:
        while (waiting := self._next()) is not None:
            descriptor, text = waiting
            _write(descriptor, f"{text}\n".encode(errors="replace"))

    def _next(self) -> tuple[int, str] | None:
        with self._changed:
            while not (self._lines or self._closing):
                self._changed.wait()
            if self._left_out:
                left_out, self._left_out = self._left_out, 0
                return 2, f"... {left_out} lines are left out here; those of programs are in {self._folder}"
            return self._lines.popleft() if self._lines else None


def _write(descriptor: int, data: bytes) -> None:
    """Write all of it, without Python's buffers, whose locks a thread that waits here would keep at the end. Who has
    closed the terminal reads nothing any more: then it goes nowhere."""
    try:
        while data:
            try:
                data = data[os.write(descriptor, data) :]
            except BlockingIOError:  # whoever shares the terminal has made it so
                select.select([], [descriptor], [])
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY | os.O_CLOEXEC)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        os.close(nowhere)
