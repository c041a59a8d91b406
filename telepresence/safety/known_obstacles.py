"""All obstacles that the gate knows, in the odometry frame: from scans, cones, bumps and what moves."""

from __future__ import annotations

import math

import numpy as np

from .messages import Odometry
from .moving_obstacles import MovingObstacles
from .obstacle_memory import Moment, ObstacleMemory
from .plane import from_base, into_base, squared_lengths
from .pose_history import PoseHistory
from .robot_profile import NARROW, RangeSource, RobotProfile
from .scan import Scan, together
from .sonar import Echo, Echoes
from .timeouts import Health, SourceTimeout

STANDSTILL_AGES = 0.2
"""Rate at which memory ages while the robot stands, relative to driving."""
LONGEST_TICK = 0.25
"""A longer time between two poses is a stall or a jump; memory then ages by this much only [s]."""
OVERRUN = 0.03
"""Points remembered farther inside the outline than this are wrong, because the robot stands there [m]."""
JUMP, FASTEST_ODOMETRY = 0.1, 2.0
"""Odometry that moves farther than this and faster has been reset [m, m/s]."""
TURN_JUMP, FASTEST_TURN = 0.2, 4.0
"""The same for its heading [rad, rad/s]."""
BUMP_WIDTH = math.radians(45.0)
"""A bumper that reports no direction was hit within this angle of the direction of motion [rad]."""
BUMP_SPACING = math.radians(11.25)
"""Angle between the points that are remembered for a bump [rad]."""
BUMP_KNOWN = 0.08
"""A bump is attributed to a known obstacle that is nearer to the outline than this [m]."""
BUMP_OUTSIDE = 0.01
"""What was hit is remembered this far outside the outline [m]."""


class KnownObstacles:
    """Everything that the gate remembers about the robot's surroundings."""

    def __init__(self, profile: RobotProfile) -> None:
        self._profile = profile
        self.poses = PoseHistory()
        self._memory = ObstacleMemory(profile.limits.memory)
        self._echoes = Echoes()
        self._moving_obstacles = MovingObstacles()
        self._pending_scans: dict[str, tuple[float, Scan]] = {}
        self._clock = 0.0

    def add_scan(self, name: str, stamp: float, scan: Scan) -> None:
        """Keep a scan (base_link) until the pose of its stamp is known; a newer one replaces it."""
        self._pending_scans[name] = stamp, scan

    def advance(self, odometry: Odometry) -> bool:
        """Advance to the newest pose. False if odometry has jumped. A jump between two ticks has moved the frame, not
        the robot: what is remembered stays where it was around the robot. After a longer time it is dropped."""
        last = self.poses.newest
        elapsed = 0.0 if last is None else max(odometry.stamp - last.stamp, 0.0)
        passed = min(elapsed, LONGEST_TICK)
        if last is not None and _has_jumped(last, odometry, passed):
            if elapsed > LONGEST_TICK:
                self.forget()
            else:
                self._carry_along(last, odometry)
            self.poses.add(odometry)
            return False
        before = self.poses.moved
        self.poses.add(odometry)
        moving = self.poses.moved > before + 0.01 * passed
        self._clock += passed * (1.0 if moving else STANDSTILL_AGES)
        return True

    def _carry_along(self, before: Odometry, after: Odometry) -> None:
        """Keep what is remembered where it was around the robot, in a frame in which that has another pose now."""
        turned = after.theta - before.theta
        self._memory.move(turned, (before.x, before.y), (after.x, after.y))
        self.poses.clear()
        self._echoes.clear()
        self._moving_obstacles.clear()
        self._pending_scans.clear()

    def forget(self) -> None:
        """Drop everything that is remembered."""
        self.poses.clear()
        self._memory.clear()
        self._echoes.clear()
        self._moving_obstacles.clear()
        self._pending_scans.clear()

    def update(self, now: float, timeouts: dict[str, SourceTimeout]) -> None:
        """Integrate the pending scans, and drop the echoes of cones that are not live."""
        pose = self.poses.current
        position = np.array([pose.x, pose.y])
        moment = Moment(now, self._clock, self.poses.driven)
        beams: list[Scan] = []
        cones: list[tuple[RangeSource, Scan]] = []
        for name, (stamp, scan) in self._pending_scans.items():
            timeout = timeouts[name]
            timeout.check_frozen(stamp, scan, self.poses.moved)
            if timeout.health(now) is Health.FROZEN:
                continue
            placed = scan.seen_from(*self.poses.at(stamp))
            if timeout.source.cone:
                cones.append((timeout.source, placed))
                continue
            if timeout.source.spread <= NARROW:
                self._moving_obstacles.observe(name, stamp, placed, position, self._memory)
            beams.append(placed)
        self._pending_scans.clear()
        if beams:
            self._memory.integrate(together(beams), position, moment)
        for source, scan in cones:
            self._echoes.observe(source, scan, self._memory.points)
        self._memory.limit(position, moment)
        self._drop_overrun(pose, position)
        for name, timeout in timeouts.items():
            if timeout.source.cone and timeout.health(now) is not Health.LIVE:
                self._echoes.forget(name)

    def add_bump(self, now: float, bearing: float | None, motion: float | None) -> float | None:
        """Remember what a bumper has hit.

        Args:
            now: [s].
            bearing: Reported by the bumper, in base_link [rad]; None if it reports none.
            motion: Direction in which the robot was driving [rad]; None if it stood.
        Returns:
            Bearing of the contact [rad]; None if nothing is known about it.
        """
        pose = self.poses.newest
        if pose is None:
            return bearing
        exact = bearing is not None
        if bearing is None:
            known = self._touching(pose)
            if known is not None or motion is None:
                return known
            bearing = motion
        width = BUMP_SPACING if exact else BUMP_WIDTH
        bearings = bearing + np.arange(-width, width + 1e-6, BUMP_SPACING)
        reach = self._profile.outline.reach(bearings) + BUMP_OUTSIDE
        felt = reach[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        lifetime = self._profile.limits.bumper_memory
        if exact:
            # Points around a corner of the outline would bar the way straight back.
            ahead = math.copysign(1.0, math.cos(bearing))
            felt = felt[self._profile.outline.measure(felt)[1][:, 0] * ahead >= 0.0]
        moment = Moment(now, self._clock, self.poses.driven)
        self._memory.add(from_base(felt, pose.x, pose.y, pose.theta), moment, lifetime)
        return bearing

    def _drop_overrun(self, pose: Odometry, position: np.ndarray) -> None:
        """Drop the points that are remembered where the robot stands."""
        outline = self._profile.outline
        inside = squared_lengths(self._memory.points - position) < outline.outer_radius**2
        if inside.any():
            which = np.flatnonzero(inside)
            distance = outline.measure(into_base(self._memory.points[which], pose.x, pose.y, pose.theta))[0]
            inside[which] = distance < -OVERRUN
            self._memory.drop(inside)

    def _touching(self, pose: Odometry) -> float | None:
        """Return the bearing of the known obstacle that may have been hit."""
        if not len(self._memory):
            return None
        distance, normals, _ = self._profile.outline.measure(into_base(self._memory.points, pose.x, pose.y, pose.theta))
        nearest = int(distance.argmin())
        if distance[nearest] > BUMP_KNOWN:
            return None
        return math.atan2(normals[nearest, 1], normals[nearest, 0])

    def obstacles(self, now: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the known obstacles in base_link now.

        Returns:
            points: (n, 2) [m].
            drift: (n,) how far odometry may have misplaced them [m].
            velocities: (n, 2) how they move over the floor [m/s].
        """
        pose, limits = self.poses.current, self._profile.limits
        drift = np.minimum(limits.drift * (self.poses.driven - self._memory.driven), limits.max_drift)
        moving, velocity = self._moving_obstacles.now(now)
        points = np.concatenate([self._memory.points, moving])
        velocities = np.zeros((len(points), 2))
        velocities[len(drift) :] = into_base(velocity, 0.0, 0.0, pose.theta)
        return (
            into_base(points, pose.x, pose.y, pose.theta),
            np.concatenate([drift, np.zeros(len(points) - len(drift))]),
            velocities,
        )

    def echoes(self) -> list[Echo]:
        """Return the unexplained readings of wide cones in base_link now."""
        pose = self.poses.current
        return [
            Echo(into_base(echo.place, pose.x, pose.y, pose.theta), into_base(echo.axis, 0.0, 0.0, pose.theta))
            for echo in self._echoes
        ]


def _has_jumped(last: Odometry, newest: Odometry, passed: float) -> bool:
    """Return whether a robot cannot have moved so in that time [s]."""
    way = math.hypot(newest.x - last.x, newest.y - last.y)
    turned = abs(math.remainder(newest.theta - last.theta, math.tau))
    return way > JUMP + FASTEST_ODOMETRY * passed or turned > TURN_JUMP + FASTEST_TURN * passed
