"""Measures how long a command takes to the safety gate and the answer back. No ROS, no Qt."""

from __future__ import annotations

import math

SILENCE = 0.5
"""[s] without an answer, of which there are 20 a second, after which a program that was gone has come back: what was
sent meanwhile has reached nobody."""


class RoundTrip:
    """Matches commands with answers that contain the age of the newest command.

    An answer proves that a command was received if that age is less than the time since the command was sent. Only our
    own clock is read. The safety gate answers 20 times a second, so a result includes up to 50 ms of waiting.
    """

    def __init__(self) -> None:
        self._sent: float | None = None
        self._heard: float | None = None

    def sent(self, now: float) -> None:
        """Note that a command was sent [monotonic s]."""
        if self._sent is None:
            self._sent = now

    def forget(self) -> None:
        """Forget the command that waits for an answer."""
        self._sent = None

    def waiting(self, now: float) -> float:
        """Return for how long a command has been waiting for an answer [s]."""
        return 0.0 if self._sent is None else now - self._sent

    def answered(self, command_age: float, now: float) -> float | None:
        """Note an answer [monotonic s]; return the round trip [s] if it is the first one after a command."""
        before, self._heard = self._heard, now
        if before is not None and now - before > SILENCE:
            self.forget()
        if self._sent is None or not math.isfinite(command_age) or now - command_age < self._sent:
            return None
        taken, self._sent = now - self._sent, None
        return taken
