"""The state that the pilot sees, from the size of command and output, without flicker."""

from __future__ import annotations

import math

from .messages import State

ENTER_LIMITED, LEAVE_LIMITED = 0.95, 0.98
"""Shares of the command that pass, below and above which the state changes."""
STANDING = 0.02
"""An output slower than this means standing [m/s]."""
MOTION_REQUESTED = 0.05
"""A command faster than this requests motion [m/s]."""
HOLD = 0.3
"""A better state must last this long before it is shown [s]."""


class GateStateFilter:
    """Shows worse states at once and better ones after `HOLD` seconds."""

    def __init__(self) -> None:
        self._state = State.CLEAR
        self._better_since = math.inf

    def update(self, now: float, requested: float, output: float) -> State:
        """Return the state to show.

        Args:
            now: [s].
            requested, output: Size of the command and of what passes, in the same unit (m/s, or rad/s times an arm).
        """
        found = self._found(requested, output)
        order = (State.CLEAR, State.LIMITED, State.BLOCKED)
        if order.index(found) >= order.index(self._state):
            self._state, self._better_since = found, math.inf
        else:
            self._better_since = min(self._better_since, now)
            if now - self._better_since >= HOLD:
                self._state, self._better_since = found, math.inf
        return self._state

    def _found(self, requested: float, output: float) -> State:
        if requested > MOTION_REQUESTED and output < STANDING:
            return State.BLOCKED
        enough = ENTER_LIMITED if self._state is State.CLEAR else LEAVE_LIMITED
        return State.CLEAR if output >= enough * requested else State.LIMITED
