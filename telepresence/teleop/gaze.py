"""Where the pilot wants to look, by whatever input, as looks to send. No Qt, no clock: times are arguments [s].

The page has the same in JavaScript: telepresence/page/static/gaze.js; a test compares the numbers.
"""

from __future__ import annotations

import math

from telepresence.teleop.looking import HeadState, Look, Manner

RATE = (1.2, 0.8)
"""How fast a key turns the head, aside and up or down [rad/s]."""
STOPS = 3
"""Looks that stop the head: if one is lost, it would turn for 0.3 s more."""
NEAR = 0.03
"""[rad]; nearer to a goal it is reached."""
PATIENCE = 2.5
"""Seconds for which a goal is repeated at most: from one side to the other takes two thirds of it."""
TURNS = {"look_left": (1, 0), "look_right": (-1, 0), "look_up": (0, -1), "look_down": (0, 1)}
"""Unit rates: left, down."""


class Gaze:
    """What turns the head.

    Attributes:
        way: Whether the head looks where the robot drives while nothing else turns it.
    """

    def __init__(self) -> None:
        self.way = False
        self._holders: dict[str, tuple[float, float]] = {}
        self._dragged: tuple[float, float, float, float] | None = None  # bearings of the pointer, angles of the head
        self._aim: tuple[Look, float] | None = None
        self._stops = 0

    @property
    def holds(self) -> bool:
        """Whether somebody turns the head at this moment."""
        return bool(self._holders) or self._dragged is not None

    def hold(self, holder: str, left: float, down: float) -> None:
        """Turn while a key, a button or a stick is held, by these parts of the rates, -1 to 1."""
        self._holders[holder] = left, down
        self._aim = self._dragged = None
        self.way = False

    def release(self, holder: str) -> None:
        """Let go of a key, a button or a stick."""
        if self._holders.pop(holder, None) is not None and not self._holders:
            self._stops = STOPS

    def drag(self, across: float, down: float, head: HeadState) -> None:
        """Begin to drag the picture at a place: how far it is from the middle, right and down [rad]."""
        self._holders.clear()
        self.way = False
        self._dragged = across, down, head.yaw, head.pitch

    def move(self, across: float, down: float, head: HeadState, now: float) -> None:
        """Drag on: what was under the pointer stays under it."""
        if self._dragged is None:
            return
        from_across, from_down, yaw, pitch = self._dragged
        wanted = yaw + across - from_across, pitch - down + from_down
        goal = (
            max(-head.left, min(head.left, wanted[0])),
            max(head.up, min(head.down, wanted[1])),
        )
        # At a limit the way back begins at once.
        self._dragged = from_across, from_down, yaw + goal[0] - wanted[0], pitch + goal[1] - wanted[1]
        self._aim = Look(Manner.GOAL, *goal), now + PATIENCE

    def drop(self) -> None:
        """The drag is over; what it asked for is still reached."""
        self._dragged = None

    def centre(self, now: float) -> None:
        """Look straight ahead."""
        self._holders.clear()
        self._dragged = None
        self.way = False
        self._aim = Look(Manner.AHEAD), now + PATIENCE

    def follow(self, wanted: bool) -> None:
        """Look where the robot drives from now on, or do so no more."""
        self._holders.clear()
        self._aim = self._dragged = None
        self.way = wanted
        if not wanted:
            self._stops = STOPS

    def let_go(self) -> None:
        """Turn no more, at once."""
        if self.holds or self._aim is not None:
            self._stops = STOPS
        self._holders.clear()
        self._aim = self._dragged = None

    def want(self, head: HeadState, now: float) -> Look | None:
        """Return what to send; None for nothing."""
        if self._holders:
            sums = (sum(parts) for parts in zip(*self._holders.values(), strict=True))
            yaw, pitch = (max(-1.0, min(1.0, total)) * most for total, most in zip(sums, RATE, strict=True))
            return Look(Manner.RATE, yaw, pitch)
        if self._aim is not None and self._dragged is None and (now > self._aim[1] or _reached(self._aim[0], head)):
            self._aim = None
        if self._aim is not None:
            return self._aim[0]
        if self._stops > 0:
            self._stops -= 1
            return Look(Manner.RATE)
        return Look(Manner.WAY) if self.way else None


def _reached(look: Look, head: HeadState) -> bool:
    yaw, pitch = (0.0, head.ahead) if look.manner is Manner.AHEAD else (look.yaw, look.pitch)
    return math.hypot(yaw - head.yaw, pitch - head.pitch) < NEAR
