"""What the robots of the control benchmark are asked to do, and what counts as error."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from control.pilots import Leg
from control.vehicles import Pose, Vehicle

QUARTER = 0.5 * math.pi
WALL_X = 4.0
"""Face of the flat hall's east wall [m]."""
WANTED_GAP = 0.10
"""Gap to be left before the wall [m]."""
WALL_WAY = 1.5
"""Distance from the body's front to the wall, as the pilot believes [m]."""


@dataclass(frozen=True)
class Task:
    """One thing to do.

    Args:
        name, about: For the report.
        scene: Where.
        start: Pose in the world for a robot whose front is `front` ahead of its middle.
        path: Legs from the start.
        scatter: How far off the start really is: along the path, aside [m], heading [rad]; uniform to either side. The
            pilot doesn't know.
        error: From where the robot really started and ended, x, y, yaw in the world, to metres.
        good: An error below this is a success [m].
    """

    name: str
    about: str
    scene: str
    start: Callable[[float], Pose]
    path: tuple[Leg, ...]
    scatter: tuple[float, float, float]
    error: Callable[[Pose, Pose, Vehicle], float]
    good: float

    def scattered(self, front: float, rng: np.random.Generator) -> Pose:
        """A start, drawn."""
        x, y, yaw = self.start(front)
        along, aside, turned = rng.uniform(-1.0, 1.0, 3) * self.scatter
        c, s = math.cos(yaw), math.sin(yaw)
        return x + along * c - aside * s, y + along * s + aside * c, yaw + turned


def _end_of(path: tuple[Leg, ...], start: Pose) -> tuple[float, float]:
    """Where the path leads to from `start`."""
    x, y, heading = start
    for leg in path:
        heading += leg.turn
        x, y = x + leg.distance * math.cos(heading), y + leg.distance * math.sin(heading)
    return x, y


def _from_its_end(path: tuple[Leg, ...]) -> Callable[[Pose, Pose, Vehicle], float]:
    """Distance from the end of the path, counted from where the robot really started."""
    return lambda start, end, _: math.dist(end[:2], _end_of(path, start))


def _from_place(x: float, y: float) -> Callable[[Pose, Pose, Vehicle], float]:
    return lambda _start, end, _: math.dist(end[:2], (x, y))


def _from_wanted_gap(_start: Pose, end: Pose, vehicle: Vehicle) -> float:
    return abs(WALL_X - end[0] - vehicle.front * math.cos(end[2]) - WANTED_GAP)


_STRAIGHT = (Leg(distance=2.0),)
_SQUARE = (Leg(distance=1.0), Leg(turn=QUARTER)) * 4
TASKS = {
    task.name: task
    for task in (
        Task(
            "straight", "2 m straight on, level floor", "flat", lambda _: (-1.5, 0.0, 0.0), _STRAIGHT,
            (0.05, 0.05, 0.03), _from_its_end(_STRAIGHT), 0.10,
        ),
        Task(
            "square", "4 x 1 m with left turns, back to the start", "flat", lambda _: (-1.5, -0.5, 0.0), _SQUARE,
            (0.05, 0.05, 0.03), _from_its_end(_SQUARE), 0.15,
        ),
        Task(
            "wall", "stop 10 cm before a wall that is up to 40 cm nearer or farther than believed", "flat",
            lambda front: (WALL_X - WALL_WAY - front, 0.0, 0.0), (Leg(distance=WALL_WAY - WANTED_GAP),),
            (0.40, 0.05, 0.02), _from_wanted_gap, 0.45,
        ),
        Task(
            "door", "through a doorway 90 cm wide, over a threshold of 10 mm", "ramp", lambda _: (-1.2, 1.9, 0.0),
            (Leg(distance=2.4),), (0.03, 0.03, 0.03), _from_place(1.2, 1.9), 0.20,
        ),
        Task(
            "ramp", "up 5 degrees, to stop on the landing", "ramp", lambda _: (-2.3, 0.0, 0.0),
            (Leg(distance=3.3),), (0.03, 0.05, 0.03), _from_place(1.0, 0.0), 0.20,
        ),
        Task(
            "rough", "2 m over ground of 14 mm, another piece of it each time", "rough", lambda _: (-1.2, 0.2, 0.0),
            _STRAIGHT, (0.05, 0.05, 0.03), _from_its_end(_STRAIGHT), 0.10,
        ),
    )
}  # fmt: skip
