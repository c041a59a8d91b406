"""How old a picture is by the time at which it was taken. No ROS, no Qt.

That time comes from the robot's clock, which may be another one than this machine's. Then the age is unknown: nothing
limits the speed by it. So the clocks count as different only if no picture of the feed has ever had a plausible time:
where one had, a later one that seems far too old is late.
"""

from __future__ import annotations

import math

CLOCKS_DIFFER = 5.0
"""[s]; an age above this, or below zero, is implausible in a feed's first pictures."""
SURE_AFTER = 1.0
"""[s] of implausible pictures from the first one on after which the clocks do differ: what had waited in a buffer when
the feed began has come by then."""


class PictureAge:
    """Tells late pictures from differing clocks."""

    def __init__(self) -> None:
        self._agreed = False
        self._since: float | None = None

    def begin(self) -> None:
        """Another feed begins: forget what is known about its clock."""
        self._agreed, self._since = False, None

    def of(self, stamp: float, today: float, now: float) -> float:
        """Return the age of a picture that is shown now [s]; NaN while the clocks disagree.

        Args:
            stamp, today: When it was taken, and the time now, by the two clocks [s since 1970].
            now: The time now [monotonic s].
        """
        if self._since is None:
            self._since = now
        age = today - stamp
        self._agreed = self._agreed or 0.0 <= age < CLOCKS_DIFFER
        return age if self._agreed and age >= 0.0 else math.nan

    def clocks_differ(self, now: float) -> bool:
        """Whether pictures have come for a while [monotonic s], and none had a plausible time."""
        return not self._agreed and self._since is not None and now - self._since >= SURE_AFTER
