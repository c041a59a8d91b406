"""Tells commands that a network has held up from those that are sent now, for messages that carry no time.

TCP loses nothing: after a cut it delivers everything that was written meanwhile, in bursts that a sender who repeats a
command ten times a second never makes. So commands are not believed while they come in bursts, nor for a moment after
the link was lost. Time is an argument; there is no clock in here.
"""

from __future__ import annotations

import math

BURST_GAP = 0.004
"""Commands nearer to each other than this [s] were written down for later delivery, or come from two programs."""
BURST = 3
"""So many in a row are a burst; two programs that both drive do not make three."""
BURST_ROOM = 1000
"""Commands that a reader must hold, so that none of a burst is overwritten before it was judged."""
SILENCE = 0.5
"""What a shorter interruption [s] holds up is not old."""
DELIVERY = 2.0
"""After a silence, bursts may come for so long [s]; later ones are a busy machine's or a fast sender's."""
CALM = 0.3
"""After a lost link and after a burst, commands are not believed for so long [s]."""


class StaleCommandFilter:
    """Of one stream of commands. The reader must see every command: a subscriber with room for a burst."""

    def __init__(self) -> None:
        self._heard = self._began = self._doubt_until = -math.inf
        self._near = 0
        self._lost = False

    def link_lost(self) -> None:
        """The link over which commands come was interrupted; whatever comes next may be old."""
        self._lost = True

    def is_stale(self, now: float) -> bool:
        """Whether the command that arrives `now` [s, monotonic] may be an old one; to be called for every command."""
        gap, self._heard = now - self._heard, now
        self._near = self._near + 1 if gap < BURST_GAP else 0
        if gap > SILENCE:
            self._began = now
        if self._lost:
            self._lost = False
            self._doubt_until = now + CALM
        if self._near >= BURST - 1 and now < self._began + DELIVERY:
            self._doubt_until = now + CALM
        return now < self._doubt_until
