"""VelocityGate: watchdogs, surroundings, guard and latches joined into one decision per tick."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .known_obstacles import KnownObstacles
from .latches import BumperLatch, StopLatch
from .messages import Command, Decision, Odometry, State
from .robot_profile import RobotProfile
from .scan import Scan, scan_of_points, scan_of_ranges
from .tick_state import TickState
from .timeouts import AHEAD_OF_TIME, CommandTimeout, Health, SourceTimeout
from .velocity_shaper import VelocityShaper

ODOMETRY_MAX_AGE = 0.5
"""[s]"""
LONGEST_RAMP = 0.1
"""Speed rises by no more than this much time's worth in one tick, however long it was [s]."""
RECENT = 0.5
"""A bump is put down to the motion commanded within this time [s]."""


class VelocityGate:
    """The velocity that may reach the wheels now. Not thread safe: one loop calls it.

    Args:
        profile: The robot.
        careful: Careful scan from the start; see `careful`.
    Attributes:
        careful: Swing the body while driving so that beams with gaps between them see everything. It sways the
            picture, so it is the pilot's choice. Without effect on a robot whose profile has no swing.
    """

    def __init__(self, profile: RobotProfile, *, careful: bool = False) -> None:
        self.profile = profile
        self.careful = careful
        self._commands = CommandTimeout(profile.limits)
        self._timeouts = {source.name: SourceTimeout(source, profile.limits) for source in profile.sources}
        self._place = KnownObstacles(profile)
        self._drive = VelocityShaper(profile)
        self._stop = StopLatch()
        self._bumper = BumperLatch()
        self._now = -math.inf
        self._dt = 0.0

    def update_ranges(self, source: str, now: float, ranges: Sequence[float], stamp: float | None = None) -> bool:
        """Take in the readings of one source, in the order of its beams.

        Args:
            source: A name from the profile.
            now: [s].
            ranges: [m]; max_range or more where nothing is, UNKNOWN where a beam says nothing.
            stamp: When it was measured [s]; now by default.
        Returns:
            False if they were refused: wrong number, a value that isn't finite, or not newer than the last.
        Raises:
            KeyError: The profile has no such source.
        """
        return self._receive(source, now, stamp, scan_of_ranges(self.profile.source(source), np.asarray(ranges, float)))

    def update_range_points(
        self, source: str, now: float, points_in_base: Sequence[Sequence[float]], stamp: float | None = None
    ) -> bool:
        """As `update_ranges`, with the place of each return in base_link, shape (n, 2) [m]."""
        points = np.asarray(points_in_base, float)
        return self._receive(source, now, stamp, scan_of_points(self.profile.source(source), points))

    def update_bumper(self, now: float, pressed: bool, bearing: float | None = None) -> None:
        """Tell the state of the bumpers; a press latches.

        Args:
            now: [s].
            pressed: Any of them is pressed.
            bearing: Where, in base_link [rad]; None if the bumper doesn't tell.
        """
        if not pressed:
            self._bumper.release()
            return
        if self._bumper.pressed and bearing is None:
            return
        heading = self._drive.heading
        motion = heading[1] if heading is not None and now - heading[0] <= RECENT else None
        bearing = self._place.bump(now, bearing, motion)
        pose = self._place.poses.newest
        self._bumper.press(None if bearing is None or pose is None else bearing + pose.theta)

    def stop(self, reason: str) -> None:
        """Stop and stay stopped until `reset_stop`. `reason` completes "Stopped: ..."."""
        self._stop.set(reason)

    def reset_stop(self) -> None:
        """A person lets the stop go. The controls must be released once before the robot moves again."""
        self._stop.reset()

    def reset_bumper(self) -> bool:
        """A person lets the bump go; what was hit stays remembered. False while a bumper is still pressed."""
        return self._bumper.reset()

    def health(self, now: float) -> dict[str, Health]:
        """State of every range source."""
        return {name: watch.health(now) for name, watch in self._timeouts.items()}

    def obstacles(self) -> np.ndarray:
        """Places of the known obstacles in base_link as of the last tick, shape (n, 2) [m]."""
        if self._place.poses.newest is None:
            return np.empty((0, 2))
        return self._place.obstacles(self._now)[0]

    def step(self, now: float, command: Command | None, odometry: Odometry | None) -> Decision:
        """Decide. Call it at a fixed rate and send every result to the base, zeros too.

        Args:
            now: [s], monotonic; the clock of all stamps.
            command: The newest one; the same object again while nothing newer has come; None if there is none.
            odometry: The newest pose.
        """
        problem = self._tick(now, command, odometry)
        if problem or odometry is None:  # a missing odometry is a problem, too
            return self._drive.halt(State.FAULT, problem, self._commands.age(now), None)
        self._place.update(now, self._timeouts)
        current = self._commands.current(now)
        self._stop.see_command(current is not None and (current.vx, current.vy, current.wz) != (0.0, 0.0, 0.0))
        view = TickState(self.profile, self._timeouts, self._place, self._bumper, now, odometry.theta)
        age = self._commands.age(now)
        if self._stop.holds:
            return self._drive.halt(State.STOPPED, self._stop.message, age, view)
        if not view.usable:
            return self._drive.halt(State.SENSOR_STALE, view.complaint, age, view)
        if current is None:
            return self._drive.halt(State.NO_COMMAND, self._commands.problem, age, view)
        dt = min(self._dt, LONGEST_RAMP)
        return self._drive.decide(now, dt, current, age, odometry.theta, view, self.careful)

    def _receive(self, name: str, now: float, stamp: float | None, scan: Scan | None) -> bool:
        stamp = now if stamp is None else stamp
        accepted = self._timeouts[name].accept(now, stamp, scan)
        if accepted and scan is not None:  # no source accepts a scan that is missing
            self._place.put(name, stamp, scan)
        return accepted

    def _tick(self, now: float, command: Command | None, odometry: Odometry | None) -> str:
        """Take in time, command and pose. Returns what is wrong with them; empty if nothing is."""
        if not math.isfinite(now):
            return "The clock gives no time."
        first, dt = self._now == -math.inf, now - self._now
        self._now = now
        if dt < 0.0:
            # Nothing that was stamped before can be told from the future now.
            self._commands.forget()
            for watch in self._timeouts.values():
                watch.forget()
            self._place.poses.clear()
            return f"The clock went back by {-dt:.2f} s."
        self._dt = 0.0 if first else dt
        if not self._commands.offer(now, command):
            return self._commands.problem
        if odometry is None or not odometry.finite:
            return "There is no odometry." if odometry is None else "Odometry holds a value that is not a number."
        if not -AHEAD_OF_TIME <= now - odometry.stamp <= ODOMETRY_MAX_AGE:
            return f"Odometry is {now - odometry.stamp:.1f} s old."
        if not self._place.move(self._dt, odometry):
            self._drive.forget_heading()
            return "Odometry jumped: the surroundings must be seen anew."
        return ""
