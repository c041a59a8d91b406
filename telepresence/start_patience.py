"""How long a program may wait for a robot, or for a program beside it, before it says so: they are often started
together, and whoever waits is not lost. Standard library only."""

from __future__ import annotations

import os
import time

PATIENCE = 10.0
"""Seconds that a machine needs which is busy with starting a whole station."""
PATIENCE_WITH_SIMULATION = 60.0
"""The same where the robot itself starts with the station, on a machine that others may keep busy, too. A simulated
robot whose program ends is reported at once by whoever started it."""
VARIABLE = "TELEPRESENCE_START_PATIENCE"
"""Environment variable: these seconds, from who starts the station."""


def patience() -> float:
    """Return for how many seconds to wait at the start."""
    return float(os.environ.get(VARIABLE) or PATIENCE)


class StartPatience:
    """Patience from its construction on; over for good once what is waited for was there."""

    def __init__(self) -> None:
        self._end = time.monotonic() + patience()

    def works(self) -> None:
        """It is there: if it goes away, that is worth a line at once."""
        self._end = 0.0

    @property
    def over(self) -> bool:
        """Whether it is time to complain."""
        return time.monotonic() >= self._end
