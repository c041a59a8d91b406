"""What the programs of a station print: all of it in files, and on the terminal what a person there is to read. That is
what they print to standard error, their warnings and errors.

The programs write to memory (memfd_create(2)): that never waits and never fails, whatever becomes of the terminal, of
the disk, or of the one who reads it here.
"""

from __future__ import annotations

import contextlib
import fcntl
import logging
import os
from pathlib import Path

log = logging.getLogger(__name__)

DIGITS = 20
"""Of a number of bytes."""
MOST_KEPT = 1_000_000
"""Bytes after which the memory is given back."""


class ProgramOutput:
    """Collects what programs print.

    Args:
        path: The file, which is written anew.
        mark: File for how much has been read, for the next `./stack up`, which takes over from this one.
        left: Where the programs print already, which go on without their `./stack up`: it has marked how much it read.
    """

    def __init__(self, path: Path, mark: Path | None = None, left: int | None = None) -> None:
        self.path = path
        self.descriptor = os.memfd_create("station-output", os.MFD_CLOEXEC) if left is None else left
        """Standard output, or standard error, for the programs."""
        flags = fcntl.fcntl(self.descriptor, fcntl.F_GETFL)
        fcntl.fcntl(self.descriptor, fcntl.F_SETFL, flags | os.O_APPEND)  # of the file, for all who have it open
        self._mark = os.open(mark, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600) if mark is not None else -1
        self._read = 0
        if (
            left is not None and self._mark >= 0
        ):  # which may have given memory back after it marked how much it had read
            self._read = min(int(os.pread(self._mark, DIGITS, 0) or 0), os.fstat(left).st_size)
        self._rest = b""
        self._file = -1
        try:
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_CLOEXEC, 0o600)
        except OSError as error:
            self._give_up(error)

    def lines(self) -> list[str]:
        """Return the lines that are complete since the last call, and write them to the file."""
        size = os.fstat(self.descriptor).st_size
        if size == self._read:
            return []
        new = os.pread(self.descriptor, size - self._read, self._read)
        self._read += len(new)
        if self._read >= MOST_KEPT and os.fstat(self.descriptor).st_size == self._read:
            os.ftruncate(self.descriptor, 0)
            self._read = 0
        if self._file >= 0:
            try:
                os.write(self._file, new)
            except OSError as error:
                self._give_up(error)
        *complete, self._rest = (self._rest + new).split(b"\n")
        if self._mark >= 0:
            with contextlib.suppress(OSError):  # a full disk: the next one says some lines again, or not at all
                # What is left of a line may have been read before the memory was given back.
                os.pwrite(self._mark, b"%*d" % (DIGITS, max(0, self._read - len(self._rest))), 0)
        return [line.decode(errors="replace") for line in complete]

    def close(self) -> None:
        """Write the rest. Programs may print on; nobody reads it."""
        self.lines()
        for descriptor in (self._file, self._mark):
            if descriptor >= 0:
                os.close(descriptor)
        os.close(self.descriptor)

    def _give_up(self, error: OSError) -> None:
        """Drop the file; the station runs on without it."""
        log.warning("what the programs print is not kept in %s: %s", self.path, error.strerror)
        if self._file >= 0:
            os.close(self._file)
        self._file = -1
