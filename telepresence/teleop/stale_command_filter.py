"""Filters out commands that a network has delayed, for messages that carry no time.

TCP loses nothing: after an interruption it delivers everything that was written meanwhile, in bursts that a sender who
repeats a command ten times a second never produces. So commands are stale while they come in bursts, and for a moment
after the link was lost. Time is an argument; there is no clock in here.
"""

from __future__ import annotations

import math

BURST_GAP = 0.004
"""Commands closer together than this [s] were queued for later delivery, or come from two programs."""
BURST = 3
"""This many in a row are a burst; two programs that both drive do not make three. So the first two are believed:
whoever is told that a command is stale has to take back the last one, too."""
BURST_ROOM = 1000
"""Queue size that a subscriber needs, so that no command of a burst is lost before it is judged."""
SILENCE = 0.5
"""An interruption shorter than this [s] makes no command stale."""
DELIVERY = 2.0
"""Bursts within this time [s] after a silence are delayed commands; later ones come from a busy machine."""
CALM = 0.3
"""Commands are stale for this long [s] after a lost link and after a burst."""


class StaleCommandFilter:
    """Judges one stream of commands. It must see every command: subscribe with a queue of `BURST_ROOM`."""

    def __init__(self) -> None:
        self._last_arrival = self._began = self._stale_until = -math.inf
        self._near = 0
        self._lost = False

    def link_lost(self) -> None:
        """Report that the link was interrupted: what arrives next may be stale."""
        self._lost = True

    def is_stale(self, now: float) -> bool:
        """Return whether the command that arrives `now` [s, monotonic] may be stale. Call it for every command."""
        gap, self._last_arrival = now - self._last_arrival, now
        self._near = self._near + 1 if gap < BURST_GAP else 0
        if gap > SILENCE:
            self._began = now
        if self._lost:
            self._lost = False
            self._stale_until = now + CALM
        if self._near >= BURST - 1 and now < self._began + DELIVERY:
            self._stale_until = now + CALM
        return now < self._stale_until
