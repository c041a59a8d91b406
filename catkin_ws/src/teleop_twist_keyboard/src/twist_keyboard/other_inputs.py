"""Whether another node's command takes the robot from the keyboard. No ROS, no clock: times are arguments, monotonic
[s]."""

from __future__ import annotations

import math

NEWCOMER_SILENCE = 1.0
"""Seconds without a command from another input after which its next one counts as taking over."""
STOP_SILENCE = 0.3
"""Seconds without a command from another input after which its zero counts as a stop. Joysticks that nobody touches
send zeros, too, but many a second."""


class OtherInputs:
    """The nodes that drive beside the keyboard. Who began last drives, and whoever stops the robot has stopped it."""

    def __init__(self) -> None:
        self._heard: dict[str, tuple[float, bool]] = {}

    def take_over(self, name: str, moves: bool, now: float) -> bool:
        """Take a command and return whether the keyboard lets go.

        Args:
            name: The node's.
            moves: Whether it is more than a zero.
        """
        at, moved = self._heard.get(name, (-math.inf, False))
        # Each rostopic pub has a name of its own.
        self._heard = {name: last for name, last in self._heard.items() if now - last[0] <= NEWCOMER_SILENCE}
        self._heard[name] = now, moves
        stops = not moves and (moved or now - at > STOP_SILENCE)
        return stops or now - at > NEWCOMER_SILENCE
