"""Held keys of a terminal -> velocity. No ROS, no terminal, no clock: the time is an argument.

A terminal reports neither that a key is released nor that two are held; it repeats the last one. So a key drives until
its repetition stays out: half a second for the first one, because keyboards wait that long before they repeat, then
0.15 s. Keys, speeds and times: rto_teleop's keyboard (dietriro/rto_core, gulbasozan/robotino-ros2). Q turns left, as
REP 103 has it; the guide's window turns right with it.
"""

from __future__ import annotations

import math

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.command_timeout import ZEROS_TIME

LINEAR, ANGULAR = 0.05, 0.5
"""Speeds at scale 1 [m/s, rad/s]."""
FIRST_HOLD, HOLD = 0.5, 0.15
"""Seconds that a key counts: pressed afresh, and repeated."""
SCALE_STEP = 1.25
LARGEST_SCALE = 10.0
HELP = """Hold a key to drive:
      W            forward
   A  S  D         left, back, right
   Q     E         turn left, turn right
   space           stop          + -   faster, slower          Ctrl-C ends"""

_DIRECTIONS = {
    "w": (1.0, 0.0, 0.0),
    "s": (-1.0, 0.0, 0.0),
    "a": (0.0, 1.0, 0.0),
    "d": (0.0, -1.0, 0.0),
    "q": (0.0, 0.0, 1.0),
    "e": (0.0, 0.0, -1.0),
}


class HeldKeys:
    """What the keys that were typed lately ask for.

    Args:
        scale_linear, scale_angular: Factors of the speeds, positive.
    Raises:
        ValueError: A factor is not positive, or too large.
    """

    def __init__(self, scale_linear: float = 1.0, scale_angular: float = 1.0) -> None:
        for name, scale in (("scale_linear", scale_linear), ("scale_angular", scale_angular)):
            if not 0.0 < scale <= LARGEST_SCALE:
                raise ValueError(f"{name} must be above 0 and at most {LARGEST_SCALE:g}, got {scale}")
        self.scale_linear, self.scale_angular = scale_linear, scale_angular
        self._key = ""
        self._until = -math.inf
        self._zeros_until = -math.inf

    def press(self, key: str, now: float) -> None:
        """A key was typed or repeated at `now` [s]. Keys without a meaning stop."""
        key = key.lower()
        if key in ("+", "="):
            self._rescale(SCALE_STEP)
        elif key in ("-", "_"):
            self._rescale(1.0 / SCALE_STEP)
        elif key in _DIRECTIONS:
            repeated = key == self._key and now <= self._until
            self._key = key
            self._until = now + (HOLD if repeated else FIRST_HOLD)
            self._zeros_until = self._until + ZEROS_TIME
        else:
            self.release(now)

    def release(self, now: float) -> None:
        """Stop."""
        self._key = ""
        self._until = -math.inf
        self._zeros_until = now + ZEROS_TIME

    def command(self, now: float) -> Velocity | None:
        """What to send at `now` [s]; None for nothing, so that others may drive."""
        if self._key and now <= self._until:
            x, y, turn = _DIRECTIONS[self._key]
            linear, angular = LINEAR * self.scale_linear, ANGULAR * self.scale_angular
            return Velocity(x * linear, y * linear, turn * angular)
        self._key = ""
        return ZERO_VELOCITY if now <= self._zeros_until else None

    def describe(self) -> str:
        """Return the speed limits as text for the pilot."""
        return f"{LINEAR * self.scale_linear:.3f} m/s, {ANGULAR * self.scale_angular:.2f} rad/s"

    def _rescale(self, factor: float) -> None:
        self.scale_linear = min(LARGEST_SCALE, self.scale_linear * factor)
        self.scale_angular = min(LARGEST_SCALE, self.scale_angular * factor)
