"""Behaviours: how the robot drives by its map. Each is a generator that is resumed many times a second.

A generator ends when its behaviour is over, with the value that the call of a client answers; closing it stops the
robot. So it needs neither a thread nor a clock of its own: a running robot resumes it from a worker, a test from a loop
that steps the world.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from concurrent.futures import Future
from itertools import pairwise
from typing import Any, Protocol, TypeVar

from pepper_sim.navigation.grid import OccupancyGrid
from pepper_sim.navigation.planner import Place, Planner
from pepper_sim.navigation.scans import compose, relative
from pepper_sim.navigation.surveyor import Surveyor
from telepresence.geometry import Pose, wrap_angle

T = TypeVar("T")
Behaviour = Generator[None, None, T]

PERIOD = 0.08
"""Behaviours are resumed this often [s]: twice per scan."""
SWEEP = 2.1
"""Turn after which the three lasers together have seen all around [rad]."""
MAX_LEG = 1.0
"""So far the robot drives before it looks at the map again [m]."""
ATTEMPTS = 6
"""How often a way is planned anew after something was in it."""

EXPLORING = (0.2, 0.7)
TRAVELLING = (0.35, 1.0)
"""Top speeds of the base [m/s, rad/s]: while the map is made, and else."""
NEAR = 0.06
"""A place is reached when the robot is so near [m]."""
MODIFIED = 1.0
"""A goal inside an obstacle is replaced by the nearest place that can be reached, if it is not farther away [m]."""

_STRAIGHT = 0.12  # a smaller error of heading is corrected while driving [rad]
_LOCAL_SIDE = 4.5  # half the side of the map of what was seen lately [m]


class NotMoved(RuntimeError):
    """The robot cannot move: it is asleep, has fallen, or is hemmed in."""


class Wheels(Protocol):
    """What behaviours drive with."""

    def go(self, x: float, y: float, theta: float, speed: float, rate: float) -> Future:
        """Drive to a pose relative to the robot at most at `speed` [m/s] and `rate` [rad/s]; True when it is there."""
        ...

    def halt(self) -> None:
        """Stop."""
        ...

    def obstacle(self) -> tuple[float, float] | None:
        """Return the obstacle (x, y [m], from the robot) that ended the last drive; None if something else did."""
        ...


class Eye(Protocol):
    """Looks around with the depth camera."""

    def look_around(self) -> Behaviour[None]:
        """Turn the head and hand over what the camera sees."""
        ...


class Driver:
    """Drives by what the surveyor knows.

    Args:
        report: Receives what happens on the way: "progress" (0 to 1), "obstacle" (x, y [m], relative to the robot) and
            "goal" (the place by odometry that replaces one inside an obstacle [m]).
    """

    def __init__(
        self,
        surveyor: Surveyor,
        wheels: Wheels,
        eye: Eye | None = None,
        report: Callable[[str, Any], None] = lambda what, value: None,
    ) -> None:
        self._surveyor = surveyor
        self._wheels = wheels
        self._eye = eye
        self._report = report

    def sweep(self, angle: float = SWEEP, *, mapping: bool = False) -> Behaviour[None]:
        """Turn on the spot so that the lasers see all around; for a map slowly, and the depth camera looks, too.

        Raises:
            NotMoved: The robot did not turn.
        """
        if not (yield from drive(self._wheels, Pose(0.0, 0.0, angle), EXPLORING if mapping else TRAVELLING)):
            raise NotMoved("the robot could not turn")
        if mapping and self._eye is not None:
            yield from self._eye.look_around()

    def explore(self, radius: float) -> Behaviour[None]:
        """Drive around and look until nothing unknown is left that can be looked at from within `radius` [m].

        Raises:
            NotMoved: The robot could not even look around where it stood.
        """
        yield from self.sweep(mapping=True)
        looked: list[Place] = [(0.0, 0.0)]
        turn = SWEEP
        while True:
            view = self._map_planner(self._surveyor.pose()).next_view((0.0, 0.0), radius, looked)
            if view is None:
                return
            looked.append(view)
            if (yield from self._follow(view, None, self._surveyor.pose, self._map_planner, EXPLORING)):
                turn = -turn
                yield from self.sweep(turn, mapping=True)

    def drive_to(self, goal: Place, theta: float | None = None) -> Behaviour[bool]:
        """Drive to a place in the map, around what is in the way.

        Args:
            goal: Place in the map [m].
            theta: Heading there [rad]; any if None.
        Returns:
            Whether the robot got there.
        """
        return (yield from self._follow(goal, theta, self._surveyor.pose, self._map_planner, TRAVELLING))

    def drive_near(
        self, x: float, y: float, theta: float | None = None, speeds: tuple[float, float] = TRAVELLING
    ) -> Behaviour[bool]:
        """Drive to a pose relative to the robot, around what it has seen lately, without any map.

        Returns:
            Whether the robot got there.
        """
        start = self._surveyor.odometry()
        goal = compose(start, Pose(x, y, theta or 0.0))
        place, planner = goal[:2], self._local_planner(start)
        if planner.way_to(place) is None:
            nearest = planner.nearest_reachable(place)
            if nearest is None or math.dist(nearest, place) > MODIFIED:
                return False
            self._report("goal", nearest)
            place = nearest
        heading = None if theta is None else goal.theta
        arrived = yield from self._follow(place, heading, self._surveyor.odometry, self._local_planner, speeds)
        return arrived and place == goal[:2]

    # --- inside ------------------------------------------------------------------------------------------------------

    def _map_planner(self, pose: Pose) -> Planner:
        exploration = self._surveyor.exploration
        if exploration is None:
            raise RuntimeError("there is no map")
        seen = self._surveyor.obstacles(pose)
        with self._surveyor.lock:
            return Planner(exploration.grid, pose[:2], seen)

    def _local_planner(self, pose: Pose) -> Planner:
        grid = OccupancyGrid(_LOCAL_SIDE, centre=pose[:2])
        return Planner(grid, pose[:2], self._surveyor.obstacles(pose), beyond=True)

    def _follow(
        self,
        goal: Place,
        theta: float | None,
        where: Callable[[], Pose],
        planner: Callable[[Pose], Planner],
        speeds: tuple[float, float],
    ) -> Behaviour[bool]:
        """Drive to `goal` in the frame in which `where` says the robot's pose, planning anew after every leg."""
        whole = 0.0
        attempts = ATTEMPTS
        while True:
            pose = where()
            way = planner(pose).way_to(goal)
            if way is None:
                return False
            left = sum(math.dist(a, b) for a, b in pairwise([pose[:2], *way]))
            whole = max(whole, left)
            self._report("progress", 1.0 - left / whole if whole > NEAR else 1.0)
            if left < NEAR:
                return theta is None or (yield from self._turn_to(theta, where, speeds))
            if not (yield from self._leg(way[0], where, speeds)):
                attempts -= 1
                obstacle = self._wheels.obstacle()
                if attempts == 0 or obstacle is None:  # somebody else stopped the robot, or it cannot move
                    return False
                self._report("obstacle", obstacle)
                yield from pause(0.5)

    def _leg(self, corner: Place, where: Callable[[], Pose], speeds: tuple[float, float]) -> Behaviour[bool]:
        """Turn towards the corner of a way and drive there, or as far as one leg may be."""
        pose = where()
        heading = math.atan2(corner[1] - pose.y, corner[0] - pose.x)
        far = math.dist(pose[:2], corner) > 2 * NEAR  # what is nearer is reached without turning
        if far and abs(wrap_angle(heading - pose.theta)) > _STRAIGHT:
            if not (yield from self._turn_to(heading, where, speeds)):
                return False
            pose = where()
        target = relative(pose, Pose(*corner, heading if far else pose.theta))
        share = min(1.0, MAX_LEG / max(math.hypot(target.x, target.y), 1e-6))
        return (yield from drive(self._wheels, Pose(target.x * share, target.y * share, target.theta), speeds))

    def _turn_to(self, theta: float, where: Callable[[], Pose], speeds: tuple[float, float]) -> Behaviour[bool]:
        return (yield from drive(self._wheels, Pose(0.0, 0.0, wrap_angle(theta - where().theta)), speeds))


def drive(wheels: Wheels, target: Pose, speeds: tuple[float, float] = TRAVELLING) -> Behaviour[bool]:
    """Drive to a pose relative to the robot; whether it got there. Closing it stops the wheels."""
    future = wheels.go(*target, *speeds)
    try:
        while not future.done():
            yield
        return bool(future.result())
    finally:
        if not future.done():
            wheels.halt()


def pause(seconds: float) -> Behaviour[None]:
    """Wait."""
    for _ in range(max(1, round(seconds / PERIOD))):
        yield
