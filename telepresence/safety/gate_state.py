"""From numbers to the state that a pilot sees, without flicker."""

from __future__ import annotations

import math

from .messages import State

ENTER_LIMITED, LEAVE_LIMITED = 0.95, 0.98
"""Share of the command that passes."""
STANDING = 0.02
"""Slower than this is standing [m/s]."""
MOTION_REQUESTED = 0.05
"""A command faster than this asks for motion [m/s]."""
HOLD = 0.3
"""A better state must last this long before it is shown [s]."""


class GateStateFilter:
    """Worse states show at once, better ones after a while."""

    def __init__(self) -> None:
        self._state = State.CLEAR
        self._better_since = math.inf

    def update(self, now: float, requested: float, output: float) -> State:
        """
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
