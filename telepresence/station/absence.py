"""Whether a station goes on while its `./stack up` is away, and for how long.

Where VARIABLE is set, and `./stack service` sets it, somebody starts `./stack up` again at once when it dies or
freezes. Until then roslaunch with its nodes, the ROS master and the virtual display go on, and the new `./stack up`
takes the station over (`telepresence.station.takeover`). If none comes, roslaunch and the master end after WAITS; what
is left then is for the next start to sweep. Standard library only.
"""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path

from telepresence.temporary_folder import owned

VARIABLE = "TELEPRESENCE_GOES_ON"
"""Environment variable: whether somebody starts `./stack up` again."""
FILE = "station.json"
"""File in the station's folder, with what the next `./stack up` has to know; without it nobody takes over."""
OWNER = "owner"
"""And with the process id of the newest `./stack up`."""
WAITS = 10.0
"""Seconds for which the station's programs go on without it."""


def goes_on() -> bool:
    """Whether this station's programs go on without `./stack up`."""
    return VARIABLE in os.environ


def name_owner(folder: Path) -> None:
    """Write into a station's folder that this process owns it; a full disk only costs that others know."""
    with contextlib.suppress(OSError):
        (folder / OWNER).write_text(str(os.getpid()), encoding="ascii")


class Absence:
    """For how long a station has been without `./stack up`, as seen by a program that goes on.

    Args:
        folder: The station's, which `./stack up` owns.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._since: float | None = None

    @property
    def owner(self) -> int:
        """Process id of the newest `./stack up`; 0 when that is not known."""
        try:
            return int((self._folder / OWNER).read_text(encoding="ascii"))
        except (OSError, ValueError):
            return 0

    def begins(self) -> bool:
        """Look; whether it is away, and was not at the last look."""
        try:
            there = owned(self._folder)
        except OSError:  # no descriptor is free: that says nothing
            return False
        if there:
            self._since = None
        elif self._since is None:
            self._since = time.monotonic()
            return True
        return False

    def too_long(self) -> bool:
        """Whether nobody is waited for any more; from then on nobody takes over."""
        if self._since is None or time.monotonic() - self._since <= WAITS:
            return False
        (self._folder / FILE).unlink(missing_ok=True)
        return True
