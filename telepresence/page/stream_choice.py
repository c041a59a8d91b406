"""Which of the two streams a viewer's network carries. No clock: the time is an argument."""

from __future__ import annotations

import math

PATIENCE = 3.0
"""[s] for which the network must have been bad."""
MOST_LOST = 0.1
"""Share of the packets: more are lost where the network does not carry them; radio alone loses a few in a hundred."""
MOST_QUEUED = 0.5
"""[s] by which the way there and back may grow: packets wait in a queue where the network is slower than they come."""
FIRST_TRY, LONGEST_WAIT = 30.0, 480.0
"""[s] after which the large pictures are tried again; each time in vain doubles it."""


class StreamChoice:
    """Decides by what the browser reports of the packets that it gets (RFC 3550, 6.4.2).

    Browsers estimated what their network carries, too (REMB); Chromium 156 does so no more.

    Attributes:
        small: Whether the small pictures are the right ones now.
    """

    def __init__(self) -> None:
        self.small = False
        self._shortest = math.inf
        self._bad_since: float | None = None
        self._changed, self._wait = 0.0, 0.0

    def choose(self, lost: float | None, round_trip: float | None, now: float, wanted: bool = False) -> bool:
        """Return `small`; to be called again and again.

        Args:
            lost: Share of the packets of late; None before the browser has reported.
            round_trip: From here to the browser and back [s]; None before it is known.
            now: [s]
            wanted: Somebody wants the small pictures whatever the network carries.
        """
        if wanted:
            self.small, self._changed, self._wait = True, now, 0.0
            return True
        self._shortest = min(self._shortest, round_trip or math.inf)
        queued = round_trip - self._shortest if round_trip else 0.0
        self._judge((lost or 0.0) > MOST_LOST or queued > MOST_QUEUED, now)
        return self.small

    def _judge(self, bad: bool, now: float) -> None:
        if self.small:
            if now - self._changed >= self._wait:
                self.small, self._changed, self._bad_since = False, now, None
        elif not bad:
            self._bad_since = None
            if now - self._changed > LONGEST_WAIT:
                self._wait = 0.0
        elif self._bad_since is None:
            self._bad_since = now
        elif now - self._bad_since >= PATIENCE:
            self.small, self._changed = True, now
            self._wait = min(LONGEST_WAIT, 2.0 * self._wait) if self._wait else FIRST_TRY
