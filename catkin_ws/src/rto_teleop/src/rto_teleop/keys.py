"""Held keys of a terminal -> velocity. No ROS, no terminal, no clock: the time is an argument.

A terminal reports neither that a key is released nor that two are held; it repeats the last one. So a key drives until
its repetition stays out: half a second for the first one, because keyboards wait that long before they repeat, then
0.15 s. Two keys add up while both drive: typed in turn, W and A are a diagonal. Where the X server says which keys are
down (`rto_teleop.x_keyboard`), a key drives exactly as long as it is held, several together.

Keys, speeds and times: rto_teleop's keyboard (dietriro/rto_core, gulbasozan/robotino-ros2). Q turns left, as REP 103
has it; the guide's window turns right with it, and slower: `LAYOUTS`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.command_timeout import ZEROS_TIME

FIRST_HOLD, HOLD = 0.5, 0.15
"""Seconds that a key counts: pressed afresh, and repeated."""
SCALE_STEP = 1.25
LARGEST_SCALE = 10.0


class Layout(NamedTuple):
    """Speeds at scale 1 [m/s, rad/s], the turning of Q [1: left], and where that comes from."""

    linear: float
    angular: float
    turn_of_q: int
    origin: str


LAYOUTS = {
    "usual": Layout(0.05, 0.5, 1, "REP 103: Q left"),
    "guide": Layout(0.05, 0.05, -1, "as in the Robotino guide's window: Q right, E left"),
}
"""Values of ~keys."""
DRIVING_KEYS = "wasdqe"
OPPOSITE = {"w": "s", "s": "w", "a": "d", "d": "a", "q": "e", "e": "q"}
HELP = """Hold a key to drive:
      W            forward
   A  S  D         left, back, right
   Q     E         turn {q}, turn {e}
   space           stop          + -   faster, slower          Ctrl-C ends
Keys {name} ({origin}); _keys:={other} is {other_origin}.
Several keys at once, W and A: {several}."""
HELD_TOGETHER = "hold both"
TYPED_IN_TURN = "type them in turn; no X server tells here which keys are held"


class HeldKeys:
    """What the keys that were typed lately, or are held, ask for.

    Args:
        scale_linear, scale_angular: Factors of the speeds, positive.
        layout: A key of `LAYOUTS`.
    Raises:
        ValueError: A factor is not positive, or too large, or there is no such layout.
    """

    def __init__(self, scale_linear: float = 1.0, scale_angular: float = 1.0, layout: str = "usual") -> None:
        for name, scale in (("scale_linear", scale_linear), ("scale_angular", scale_angular)):
            if not 0.0 < scale <= LARGEST_SCALE:
                raise ValueError(f"{name} must be above 0 and at most {LARGEST_SCALE:g}, got {scale}")
        if layout not in LAYOUTS:
            raise ValueError(f"keys must be one of {', '.join(LAYOUTS)}, got {layout!r}")
        self.scale_linear, self.scale_angular = scale_linear, scale_angular
        self._name, self._layout = layout, LAYOUTS[layout]
        q = self._layout.turn_of_q
        self._directions = {
            "w": (1, 0, 0), "s": (-1, 0, 0), "a": (0, 1, 0), "d": (0, -1, 0), "q": (0, 0, q), "e": (0, 0, -q),
        }  # fmt: skip
        self._until: dict[str, float] = {}
        self._watched: set[str] = set()
        self._let_go: dict[str, float] = {}
        self._last = ""
        self._zeros_until = -math.inf

    @property
    def watched(self) -> bool:
        """Whether a key drives that `observe` has to be called for."""
        return bool(self._watched)

    def press(self, key: str, now: float, held: bool = False) -> None:
        """A key was typed or repeated at `now` [s]. Keys without a meaning stop.

        Args:
            held: The X server says that it is down: it drives as long as `observe` says so.
        """
        key = key.lower()
        if key in ("+", "="):
            self._rescale(SCALE_STEP)
        elif key in ("-", "_"):
            self._rescale(1.0 / SCALE_STEP)
        elif key in self._directions:
            if held:
                self._watched.add(key)
            else:
                self._watched.discard(key)
                self._drop_opposite(key)
            repeated = key == self._last and now <= self._until.get(key, -math.inf)
            late = now - self._let_go.get(key, -math.inf) <= FIRST_HOLD  # a repetition that was still on its way
            self._last = key
            self._until[key] = now + (HOLD if held or repeated or late else FIRST_HOLD)
            self._zeros_until = max(self._until.values()) + ZEROS_TIME
        else:
            self.release(now)

    def observe(self, down: frozenset[str], now: float) -> None:
        """Take which keys are down, by the X server: those that were `held` drive on, or end."""
        for key in tuple(self._watched):
            if key in down:
                self._until[key] = now + HOLD
                self._zeros_until = now + HOLD + ZEROS_TIME
            else:
                self._watched.discard(key)
                del self._until[key]
                self._let_go[key] = now

    def release(self, now: float) -> None:
        """Stop."""
        self._until.clear()
        self._watched.clear()
        self._last = ""
        self._zeros_until = now + ZEROS_TIME

    def command(self, now: float) -> Velocity | None:
        """What to send at `now` [s]; None for nothing, so that others may drive."""
        live = [self._directions[key] for key, until in self._until.items() if now <= until]
        if live:
            x, y, turn = (sum(parts) for parts in zip(*live, strict=True))
            linear, angular = self._layout.linear * self.scale_linear, self._layout.angular * self.scale_angular
            return Velocity(x * linear, y * linear, turn * angular)
        return ZERO_VELOCITY if now <= self._zeros_until else None

    def describe(self) -> str:
        """Return the speed limits as text for the pilot."""
        linear, angular = self._layout.linear * self.scale_linear, self._layout.angular * self.scale_angular
        return f"{linear:.3f} m/s, {angular:.2f} rad/s"

    def help(self, several: str = TYPED_IN_TURN) -> str:
        """Return what the keys do. `several`: how to press several at once."""
        q, e = ("left", "right")[:: self._layout.turn_of_q]
        other = next(name for name in LAYOUTS if name != self._name)
        return HELP.format(
            q=q, e=e, name=self._name, origin=self._layout.origin, other=other, other_origin=LAYOUTS[other].origin,
            several=several,
        )  # fmt: skip

    def _drop_opposite(self, key: str) -> None:
        """Forget the typed key of the other way: a reversal must not wait until it has timed out."""
        opposite = OPPOSITE[key]
        if opposite not in self._watched:
            self._until.pop(opposite, None)

    def _rescale(self, factor: float) -> None:
        self.scale_linear = min(LARGEST_SCALE, self.scale_linear * factor)
        self.scale_angular = min(LARGEST_SCALE, self.scale_angular * factor)
