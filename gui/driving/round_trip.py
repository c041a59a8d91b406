"""How long a command needs to the safety gate and its answer back. No ROS, no Qt."""

from __future__ import annotations

import math


class RoundTrip:
    """Matches commands that were sent with answers that tell the age of the newest command.

    An answer proves that a command was heard if it tells an age that is less than the time since that was sent. Only
    our own clock is read. The safety gate answers 20 times a second, so a figure holds up to 50 ms of waiting.
    """

    def __init__(self) -> None:
        self._sent: float | None = None

    def sent(self, now: float) -> None:
        """A command has left [monotonic s]."""
        if self._sent is None:
            self._sent = now

    def forget(self) -> None:
        """No command is on its way."""
        self._sent = None

    def waiting(self, now: float) -> float:
        """For how long a command has been on its way without an answer [s]."""
        return 0.0 if self._sent is None else now - self._sent

    def answered(self, command_age: float, now: float) -> float | None:
        """An answer came [monotonic s]; the round trip [s] if it is the first after a command."""
        if self._sent is None or not math.isfinite(command_age) or now - command_age < self._sent:
            return None
        taken, self._sent = now - self._sent, None
        return taken
