"""How long the next picture may take before the robot stops. No ROS, no Qt.

The robot must rest half a second after its pictures stop, and braking alone takes up to 0.2 s of it. So the patience
follows the pictures: it lasts for two and a half of their usual periods, so that one may be lost and the next one half
a period late. Below 8 pictures a second that takes longer than half a second in all: a slow link drives jerkily or not
at all if every picture counts as late.
"""

from __future__ import annotations

import statistics
from collections import deque

LEAST_PATIENCE, MOST_PATIENCE = 0.3, 1.0
"""[s]. The least: a busy machine delivers one picture in a few hundred so late. The most: for less than one picture in
0.4 s, and until the period is known."""
PERIODS = 2.5
"""Usual periods between two pictures that the next one may take."""
REMEMBERED = 9
"""Periods of which the median is the usual one: an interruption does not change it, a link that has become slower does
after five pictures."""
FEWEST = 3
"""Periods from which on the usual one is known."""


class PicturePatience:
    """Measures the usual period of pictures. Times are monotonic [s]."""

    def __init__(self) -> None:
        self._periods: deque[float] = deque(maxlen=REMEMBERED)
        self._arrived: float | None = None

    def note(self, arrived: float) -> None:
        """Note that a picture has arrived."""
        if self._arrived is not None and arrived > self._arrived:
            self._periods.append(arrived - self._arrived)
        self._arrived = arrived

    def forget(self) -> None:
        """Forget the period: other pictures come from now on."""
        self._periods.clear()
        self._arrived = None

    def seconds(self) -> float:
        """Return for how long the newest picture is good enough to drive by, from its arrival on [s]."""
        if len(self._periods) < FEWEST:
            return MOST_PATIENCE
        return min(MOST_PATIENCE, max(LEAST_PATIENCE, PERIODS * statistics.median(self._periods)))
