"""Motion of Pepper's base: velocities, moves along waypoints, stops, and refusals.

Every method is called with the world's lock held; futures are completed through `post`, outside the lock.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

from pepper_sim.body.collision_protection import SecurityZone
from pepper_sim.body.description import ABRUPT_BRAKING, MOTION_CYCLE
from pepper_sim.body.joints import resolve
from pepper_sim.body.state import MoveFailure
from telepresence.geometry import wrap_angle
from telepresence.sim.base import BaseLimits, PlanarBase
from telepresence.sim.world import TICK

REACHED_XY, REACHED_THETA = 0.0015, 0.002
"""A move has arrived when odometry is this close to its end [m, rad]."""
BLOCKED_SPEED = 0.01
"""Slower than this [m/s] because of an obstacle counts as blocked."""
BLOCKED_PATIENCE = 0.5
"""A move that is blocked for this long [s] fails."""
CHECK_TICKS = round(MOTION_CYCLE / TICK)
"""Obstacles are checked once per motion cycle, and at once for a new command."""

_MARGIN = 0.9  # fraction of the acceleration that planned braking uses; the rest corrects errors
_CORNER_RADIUS = 0.03  # a waypoint on the way is passed within this distance [m]

Pose = tuple[float, float, float]


@dataclass
class _Leg:
    """One straight piece of a move: the pose at its end, its direction, top speeds, and how fast its end is passed."""

    x: float
    y: float
    theta: float
    direction: tuple[float, float]
    speed: float
    rate: float
    exit_speed: float


class BaseMotion:
    """Decides the velocity of the base at every tick."""

    def __init__(self, base: PlanarBase, zone: SecurityZone, post: Callable[[Callable[[], None]], None]) -> None:
        """`post` runs a callable later, outside the world's lock."""
        self.failure = MoveFailure()
        self._base = base
        self._zone = zone
        self._post = post
        self._velocity = (0.0, 0.0, 0.0)
        self._legs: list[_Leg] = []
        self._arrival: Future | None = None
        self._standing: list[Future] = []
        self._abrupt = False
        self._blocked_since: float | None = None
        self._failure_reported = False  # a velocity that is sent repeatedly fails once, not every time
        self._ticks_to_check = 0
        self._allowed_speed = math.inf
        self._obstacle: tuple[float, float] | None = None

    @property
    def moving(self) -> bool:
        """Whether a motion is unfinished or the base still rolls."""
        return not self._base.standing or bool(self._legs) or any(self._velocity)

    def reset(self) -> None:
        """Stand still at the origin; moves and stops that somebody waits for end."""
        self._base.reset()
        self.release()

    def release(self) -> None:
        """End moves and stops that somebody waits for, although nothing will move any more."""
        self._end_move(False)
        self._velocity = (0.0, 0.0, 0.0)
        self._finish_stops(stands=True)

    def set_velocity(self, vx: float, vy: float, wz: float) -> None:
        """Drive until the next command; ends a move."""
        self._end_move(False)
        self._abrupt = False
        self._velocity = self._base.clamp(vx, vy, wz)
        self._ticks_to_check = 0
        if not any(self._velocity):
            self._failure_reported = False

    def move_to(self, waypoints: Sequence[Pose], duration: float | None) -> Future:
        """Drive through `waypoints`, given in the robot's frame as it stands now, and stop in the last one."""
        self._end_move(False)
        self._velocity = (0.0, 0.0, 0.0)
        self._abrupt = False
        self._failure_reported = False
        self._ticks_to_check = 0
        self._arrival = Future()
        self._legs = _plan(self._base.odometry, waypoints, self._base.limits, duration)
        return self._arrival

    def stop(self, abrupt: bool) -> Future:
        """Brake to a standstill.

        Returns:
            Future: True when the wheels stand still, False when another command makes them go on.
        """
        self._end_move(False)
        self._velocity = (0.0, 0.0, 0.0)
        self._failure_reported = False
        self._abrupt = abrupt
        future: Future = Future()
        self._standing.append(future)
        if self._base.standing:
            self._finish_stops(stands=True)
        return future

    def refuse(self, cause: str) -> None:
        """End the base's motion because of the robot's own state, and count the failure."""
        if self._legs or (any(self._velocity) and not self._failure_reported):
            self._failure_reported = True
            self._fail(cause, (0.0, 0.0, 0.0))
        self._velocity = (0.0, 0.0, 0.0)
        self._end_move(False)

    def tick(self, now: float, dt: float) -> None:
        """Advance by one tick: plan, respect obstacles, accelerate, integrate odometry."""
        if not self.moving:
            if self._standing:
                self._finish_stops(stands=True)
            return
        if self._arrival is not None and self._arrival.cancelled():
            self._end_move(False)
        if self._legs or any(self._velocity):  # another command: whoever waits for the stop would wait for ever
            self._finish_stops(stands=False)
        vx, vy, wz = self._plan_velocity() if self._legs else self._velocity
        if vx or vy:
            speed = math.hypot(vx, vy)
            if self._ticks_to_check <= 0:
                self._ticks_to_check = CHECK_TICKS
                factor, self._obstacle = self._zone.limit(vx, vy, self._base.odometry)
                self._allowed_speed = factor * speed if self._obstacle else math.inf
            self._ticks_to_check -= 1
            if self._allowed_speed < speed:
                vx, vy = vx * self._allowed_speed / speed, vy * self._allowed_speed / speed
            if self._obstacle is not None:
                self._check_blocked(now, self._allowed_speed, self._obstacle)
            else:
                self._blocked_since = None
                self._failure_reported = False
        braking = ABRUPT_BRAKING if self._abrupt else None
        self._base.drive(vx, vy, wz, dt, braking=braking, on_course=bool(self._legs))
        if self._base.standing:
            self._finish_stops(stands=True)

    def _plan_velocity(self) -> Pose:
        """Return the velocity towards the end of the current leg: the fastest that can still stop there."""
        base, leg = self._base, self._legs[0]
        dx, dy, turn = leg.x - base.x, leg.y - base.y, wrap_angle(leg.theta - base.theta)
        distance = math.hypot(dx, dy)
        if len(self._legs) > 1 and self._passed(leg, dx, dy, distance):
            self._legs.pop(0)
            return self._plan_velocity()
        if len(self._legs) == 1 and distance < REACHED_XY and abs(turn) < REACHED_THETA:
            self._end_move(True)
            return 0.0, 0.0, 0.0
        limits = base.limits
        speed = min(leg.speed, math.sqrt(leg.exit_speed**2 + 2.0 * _MARGIN * limits.acc_xy * distance))
        rate = min(leg.rate, math.sqrt(2.0 * _MARGIN * limits.acc_theta * abs(turn)))
        wz = math.copysign(rate if abs(turn) >= REACHED_THETA / 2 else 0.0, turn)
        if distance < REACHED_XY / 2:
            return 0.0, 0.0, wz
        c, s = math.cos(base.theta), math.sin(base.theta)
        ux, uy = dx / distance, dy / distance
        return speed * (ux * c + uy * s), speed * (uy * c - ux * s), wz

    def _passed(self, leg: _Leg, dx: float, dy: float, distance: float) -> bool:
        """Whether a waypoint on the way is behind: driven past, or reached where the path has a sharp corner."""
        beyond = dx * leg.direction[0] + dy * leg.direction[1] <= 0.0
        return beyond or distance < (_CORNER_RADIUS if leg.exit_speed > 0.0 else REACHED_XY)

    def _check_blocked(self, now: float, speed: float, obstacle: tuple[float, float]) -> None:
        if speed >= BLOCKED_SPEED:
            self._blocked_since = None
            return
        if self._blocked_since is None:
            self._blocked_since = now
        refused = self._base.standing
        if self._legs and (refused or now - self._blocked_since >= BLOCKED_PATIENCE):
            self._fail("obstacle", (*obstacle, 0.0))
            self._end_move(False)
        elif not self._legs and not self._failure_reported:
            self._failure_reported = True
            self._fail("obstacle", (*obstacle, 0.0))

    def _fail(self, cause: str, obstacle: tuple[float, float, float]) -> None:
        self.failure = MoveFailure(self.failure.count + 1, cause, not self._base.standing, obstacle)

    def _end_move(self, reached: bool) -> None:
        self._legs = []
        self._blocked_since = None
        if self._arrival is not None:
            future, self._arrival = self._arrival, None
            self._post(lambda: resolve(future, reached))

    def _finish_stops(self, *, stands: bool) -> None:
        waiting, self._standing = self._standing, []
        self._abrupt = False
        for future in waiting:
            self._post(partial(resolve, future, stands))


def _plan(start: Pose, waypoints: Sequence[Pose], limits: BaseLimits, duration: float | None) -> list[_Leg]:
    """Plan the legs through `waypoints`; translation and rotation of a leg take the same time."""
    c, s = math.cos(start[2]), math.sin(start[2])
    poses = [start]
    for x, y, theta in waypoints:
        poses.append((start[0] + x * c - y * s, start[1] + x * s + y * c, start[2] + theta))
    acc_xy, acc_theta = _MARGIN * limits.acc_xy, _MARGIN * limits.acc_theta
    pieces = []
    for a, b in pairwise(poses):
        dx, dy, turn = b[0] - a[0], b[1] - a[1], abs(wrap_angle(b[2] - a[2]))
        distance = math.hypot(dx, dy)
        direction = (dx / distance, dy / distance) if distance else (0.0, 0.0)
        time = max(_ramp_time(distance, limits.max_xy, acc_xy), _ramp_time(turn, limits.max_theta, acc_theta))
        pieces.append((direction, distance, turn, time))
    total = sum(piece[3] for piece in pieces)
    stretch = max(1.0, duration / total) if duration and total > 0.0 else 1.0
    legs = []
    for pose, (direction, distance, turn, time) in zip(poses[1:], pieces, strict=True):
        # A leg without translation or rotation may still have to correct errors of the leg before.
        speed = _top_speed(distance, time * stretch, limits.max_xy, acc_xy) if distance > 0.01 else limits.max_xy
        rate = _top_speed(turn, time * stretch, limits.max_theta, acc_theta) if turn > 0.05 else limits.max_theta
        legs.append(_Leg(*pose, direction, speed, rate, 0.0))
    for leg, following in pairwise(legs):
        leg.exit_speed = min(leg.speed, following.speed) * _corner_factor(leg.direction, following.direction)
    return legs


def _corner_factor(before: tuple[float, float], after: tuple[float, float]) -> float:
    """Return the fraction of the speed at which a corner may be passed: 1 straight on, 0 from 60 degrees on."""
    return max(0.0, 2.0 * (before[0] * after[0] + before[1] * after[1]) - 1.0)


def _ramp_time(distance: float, speed: float, acceleration: float) -> float:
    """Return the shortest time from rest to rest over `distance` [s]."""
    if distance < speed * speed / acceleration:
        return 2.0 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration


def _top_speed(distance: float, time: float, speed: float, acceleration: float) -> float:
    """Return the cruising speed that covers `distance` from rest to rest in `time`, at most `speed`."""
    root = (acceleration * time) ** 2 - 4.0 * acceleration * distance
    return min(speed, 0.5 * (acceleration * time - math.sqrt(root))) if root > 0.0 else speed
