"""Limits the speed when the link is slow. No ROS, no Qt.

From 200 to 300 ms of delay on people drive clearly worse; beyond 400 ms it gets no worse, but what they see is no
longer where the robot is (arXiv 2508.18074). So the window lets a robot drive at half speed above half a second, and
not at all above one.
"""

from __future__ import annotations

import math
from collections import deque

HALF_FROM, STOP_FROM = 0.5, 1.0
"""[s]"""
WINDOW = 0.5
"""[s]; the least delay in this time counts: one late message on a busy machine is not a slow link."""
FORGET_AFTER = 2.0
"""[s] after which a measured delay is no longer valid."""


class DelaySpeedLimit:
    """Computes the share of the speed that may be asked for. Times are monotonic [s]."""

    def __init__(self) -> None:
        self._commands: deque[tuple[float, float]] = deque()
        self._pictures: deque[tuple[float, float]] = deque()
        self._unproven = False

    def note_command(self, delay: float, now: float) -> None:
        """Note the round trip of a command, or for how long one has been waiting for its answer [s]."""
        _note(self._commands, delay, now)

    def note_picture(self, age: float, now: float) -> None:
        """Note how old a picture was when it was shown [s]; NaN, when the clocks disagree, is ignored."""
        if math.isfinite(age):
            _note(self._pictures, age, now)

    def delay(self, now: float) -> float:
        """Return the greater of the two delays [s]; 0 when neither is known."""
        return max(_least(self._commands, now), _least(self._pictures, now))

    def share(self, now: float) -> float:
        """Return 1, 0.5 or 0. When commands are too late none are sent, so there is nothing to measure: the next ones
        go at half speed until one is answered in time."""
        delay, command = self.delay(now), _least(self._commands, now)
        if command > STOP_FROM:
            self._unproven = True
        elif 0.0 < command <= HALF_FROM:
            self._unproven = False
        if delay > STOP_FROM:
            return 0.0
        return 0.5 if delay > HALF_FROM or self._unproven else 1.0


def _note(delays: deque[tuple[float, float]], delay: float, now: float) -> None:
    delays.append((now, delay))
    while len(delays) > 2 and now - delays[0][0] > WINDOW:
        delays.popleft()


def _least(delays: deque[tuple[float, float]], now: float) -> float:
    fresh = [delay for when, delay in delays if now - when <= FORGET_AFTER]
    return min(fresh, default=0.0)
