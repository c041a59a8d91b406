"""What is latched in the safety gate, in a file on the robot: a drive server that dies and is started again goes on
with it. One that ends in order forgets it, and so does a robot that is switched off: the file is in a folder of this
boot's.
"""

from __future__ import annotations

import json
import logging
import math
import os
import time
from pathlib import Path

from telepresence.safety import Latched
from telepresence.security import private_files
from telepresence.security.outside_text import clean

log = logging.getLogger(__name__)

PAUSE = 1.0
"""Seconds after which a file that could not be written is tried again."""


def default_path(port: int) -> Path | None:
    """Return the file of the drive server at this port: in the service's folder (systemd), else in the station's; None
    where there is neither, and nothing is kept."""
    if folder := os.environ.get("RUNTIME_DIRECTORY") or os.environ.get("TELEPRESENCE_STATION"):
        return Path(folder, f"latched-{port}")
    return None


class KeptLatches:
    """The file at `path`; with None nothing is kept."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._kept = Latched()
        self._again = -math.inf

    def read(self) -> Latched:
        """Return what was latched in a server that died. What cannot be understood counts as a bump."""
        if self._path is None:
            return Latched()
        try:
            found = json.loads(private_files.read(self._path))
            stopped, bumped = found["stopped"], found["bumped"]
            if not (isinstance(stopped, str) and isinstance(bumped, bool)):
                raise TypeError("of other types")
            self._kept = Latched(clean(stopped), bumped)
        except FileNotFoundError:
            return Latched()
        except (OSError, ValueError, TypeError, KeyError) as error:
            log.warning("what was latched before cannot be read (%s): the robot counts as bumped into something", error)
            return Latched(bumped=True)
        return self._kept

    def keep(self, latched: Latched) -> None:
        """Keep this; to be called at every step."""
        if self._path is None or latched == self._kept or time.monotonic() < self._again:
            return
        try:
            private_files.write(self._path, json.dumps(latched._asdict()).encode())
            self._kept = latched
        except OSError as error:
            self._again = time.monotonic() + PAUSE
            log.error("if the drive server dies now, what is latched is lost: %s", error)

    def forget(self) -> None:
        try:
            if self._path is not None:
                self._path.unlink(missing_ok=True)
        except OSError as error:
            log.error("what was latched is not forgotten: %s", error)
