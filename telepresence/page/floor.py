"""A browser that holds a place on the floor in the picture: where that is, and how the robot gets there.

The page sends only where in the picture somebody points, and when that picture was taken. The ground is computed here,
with the transforms of that time, by what the window uses, too: `telepresence.teleop.floor_goal`.
"""

from __future__ import annotations

import time
from typing import Any, Protocol

from telepresence.page.commands import FloorMessage
from telepresence.teleop.camera_view import NO_PICTURE
from telepresence.teleop.floor_band import floor_band
from telepresence.teleop.floor_goal import HOLD, FloorGoal, FloorStep
from telepresence.teleop.floor_projection import scaled_to
from telepresence.teleop.hand_speeds import TURN_PER_SPEED
from telepresence.teleop.robot_readings import BodyState, CameraView, Safety

BAND_STEP = 0.15
"""[m] between two points of the band's edges: what is painted ten times a second goes by radio."""
BESIDE = 2.0
"""Widths of the picture: corners of the band farther beside it are no nearer to what is painted."""


class Floor(Protocol):
    """What one robot sees of the floor.

    Attributes:
        farthest: Places farther away are driven to in part [m].
        radius: The robot's [m].
        top_speed, top_turn: As fast as its safety gate ever allows [m/s, rad/s].
    """

    farthest: float
    radius: float
    top_speed: float
    top_turn: float

    @property
    def body(self) -> BodyState | None:
        """The newest odometry."""

    @property
    def safety(self) -> Safety | None:
        """The newest word of the safety gate."""

    def newest(self) -> float | None:
        """Return when the newest picture was taken [s since 1970]."""

    def view(self, stamp: float) -> CameraView | str:
        """Return the camera's view in odom at that time [s since 1970]; or why it is unknown."""


class BrowserFloor:
    """One browser's hand on the floor. Belongs to one event loop."""

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._press = 0
        self._stamp: float | None = None
        self._held: tuple[float, float, float | None] | None = None
        self._goal = FloorGoal(self._view, self._age, floor.farthest)

    def step(self, message: FloorMessage, now: float, forbidden: str) -> FloorStep:
        """Return what follows from a message. What it says of holding passes by itself.

        Args:
            now: Our clock, monotonic [s].
            forbidden: Why this browser may not drive until something is pressed again; empty when it may.
        """
        goal, floor = self._goal, self._floor
        goal.body, goal.safety = floor.body, floor.safety
        goal.speed = min(message.speed, floor.top_speed)
        goal.turn = min(floor.top_turn, goal.speed * TURN_PER_SPEED)
        held = (*message.at, message.stamp)
        if forbidden:
            first, self._press = goal.held or message.press != self._press, message.press
            return goal.end(forbidden if first else "")
        if message.press != self._press:
            self._press = message.press
            self._take(held)
            goal.press(*message.at, now - HOLD)  # the page has waited already
        elif goal.held and held != self._held:
            self._take(held)
            goal.drag(*message.at)
        return goal.step(now, message.hold)

    def let_go(self) -> bool:
        """Hold nothing any more; whether something was held."""
        held = self._goal.held
        if held:
            self._goal.end()
        return held

    def way(self) -> dict[str, Any] | None:
        """Return the way to the place that is held, as shares of the newest picture and JSON's types; None for none.

        `tone` is free, slow or blocked; `edge` and `ring` are the corners of the band that the body sweeps and of the
        place where it stops.
        """
        goal, stamp = self._goal, self._floor.newest()
        if goal.target is None or goal.body is None or stamp is None:
            return None
        view = self._floor.view(stamp)
        if isinstance(view, str):
            return None
        start = goal.body.x, goal.body.y
        band = floor_band(view, start, goal.target, self._floor.radius, BAND_STEP)
        width, height = view.lens.width, view.lens.height

        def shares(corners: list[tuple[float, float]]) -> list[list[float]]:
            return [[round(_near(u / width), 3), round(_near(v / height), 3)] for u, v in corners]

        return {"tone": goal.tone(time.monotonic()), "edge": shares(band.edge), "ring": shares(band.ring[::2])}

    def _take(self, held: tuple[float, float, float | None]) -> None:
        self._held = held
        self._stamp = held[2] if held[2] is not None else self._floor.newest()

    def _age(self) -> float:
        return float("inf") if self._stamp is None else time.time() - self._stamp

    def _view(self) -> CameraView | str:
        if self._stamp is None:
            return NO_PICTURE
        view = self._floor.view(self._stamp)
        return view if isinstance(view, str) else scaled_to(view, 1, 1)  # pixels are shares


def _near(share: float) -> float:
    return min(1.0 + BESIDE, max(-BESIDE, share))
