# Runs on Pepper's own Python 2.7 as well as on Python 3: keep to syntax that both accept.
# ruff: noqa: UP004
"""Lines for people from a program that must not wait for them: a terminal that is gone, stopped or full takes nothing,
and a robot must be stopped all the same."""

import collections
import os
import threading

MYPY = False
if MYPY:
    from typing import Any, Deque  # noqa: F401, UP035

WAITING = 100
"""Lines that wait for a reader at most; older ones are dropped."""


class LineWriter(object):
    """Takes a text and writes it as a line, on a thread of its own.

    Args:
        descriptor: Of the open file. Written without Python's buffer, whose lock an ending program would wait for.
        prefix: In front of each line.
    """

    def __init__(self, descriptor, prefix):
        # type: (int, str) -> None
        self._descriptor, self._prefix = descriptor, prefix
        self._lines = collections.deque(maxlen=WAITING)  # type: Deque[bytes]
        self._changed = threading.Condition()
        self._thread = None  # type: Any
        self._idle = threading.Event()

    def __call__(self, text):
        # type: (Any) -> None
        line = "".join((self._prefix, text, "\n"))  # type: Any
        if not isinstance(line, bytes):  # Python 2.7 has bytes for texts, but where a pilot's name holds any letter
            line = line.encode("utf-8", "replace")
        with self._changed:
            self._idle.clear()
            self._lines.append(line)
            self._changed.notify()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="lines")
                self._thread.daemon = True
                self._thread.start()

    def flush(self, patience):
        # type: (float) -> None
        """Wait until everything is written, `patience` seconds at most."""
        if self._thread is not None:
            self._idle.wait(patience)

    def _run(self):
        # type: () -> None
        while True:
            with self._changed:
                while not self._lines:
                    self._idle.set()
                    self._changed.wait()
                line = self._lines.popleft()
            try:
                while line:
                    line = line[os.write(self._descriptor, line) :]
            except EnvironmentError:  # noqa: UP024  nobody reads it any more
                pass
