"""Who came in, who drove, what was refused: one line of JSON each, in a file that is kept, and in the program's log."""

from __future__ import annotations

import json
import logging
import os
import time
from collections import OrderedDict
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any, TextIO

from telepresence.security import private_files
from telepresence.security.outside_text import clean

log = logging.getLogger("rosout.page")  # below ROS's own, which prints and keeps it
LARGEST, FILES = 4_000_000, 2
"""Bytes of a file, and how many older ones stay."""
SAMPLED = 10.0
"""[s] between two lines about the same thing that is refused again and again."""
MOST_SAMPLED = 256


class Audit:
    """Writes the lines.

    Args:
        file: Readable for its owner only; None for the log alone.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = _PrivateFile(file) if file else None
        self._sampled: OrderedDict[tuple[str, ...], tuple[float, int]] = OrderedDict()

    def note(self, what: str, **facts: Any) -> None:
        """Write a line.

        Args:
            what: "came in", "refused".
            facts: Who, from where, by what.
        """
        fields = {name: clean(value) if isinstance(value, str) else value for name, value in facts.items() if value}
        log.info("%s: %s", what, ", ".join(f"{name} {value}" for name, value in fields.items()))
        if self._file is not None:
            stamp = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
            line = json.dumps({"time": stamp, "what": what} | fields, ensure_ascii=False)
            self._file.emit(logging.LogRecord("audit", logging.INFO, "", 0, line, None, None))

    def sample(self, what: str, **facts: str) -> None:
        """Write a line about what comes again and again: one in `SAMPLED`, with how many there were."""
        key, now = (what, *facts.values()), time.monotonic()
        written, left_out = self._sampled.pop(key, (-SAMPLED, 0))
        if now - written >= SAMPLED:
            self.note(what, **facts, times=left_out + 1)
            written, left_out = now, -1
        self._sampled[key] = written, left_out + 1
        if len(self._sampled) > MOST_SAMPLED:
            self._sampled.popitem(last=False)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


class _PrivateFile(RotatingFileHandler):
    def __init__(self, file: Path) -> None:
        private_files.make_folder(file.parent, close=False)
        super().__init__(file, maxBytes=LARGEST, backupCount=FILES, encoding="utf-8")

    def _open(self) -> TextIO:  # type: ignore[override]
        descriptor = private_files.open_file(Path(self.baseFilename), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        return open(descriptor, "a", encoding="utf-8")
