"""VelocityGate: timeouts, obstacles, latches and velocity shaping joined into one decision per tick."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .known_obstacles import LONGEST_TICK, KnownObstacles
from .latches import BumperLatch, Latched, StopLatch
from .messages import Command, Decision, Odometry, State
from .robot_profile import RobotProfile
from .scan import Scan, scan_of_points, scan_of_ranges
from .tick_state import TickState
from .timeouts import AHEAD_OF_TIME, BumperTimeout, CommandTimeout, Health, SourceTimeout
from .velocity_shaper import VelocityShaper

ODOMETRY_MAX_AGE = 0.5
"""Older odometry is a fault [s]."""
LONGEST_RAMP = 0.1
"""A tick counts as no longer than this for the speed ramp [s]."""
PRECOMPUTED_MAX_AGE = 0.05
"""`step` reuses what `precompute` has computed for no longer than this, one tick, because sources fall silent [s]."""
RECENT = 0.5
"""A bump is attributed to motion commanded within this time [s]."""


class VelocityGate:
    """Decides which velocity may reach the wheels now. Not thread safe: one loop calls it.

    Args:
        profile: The robot.
        careful: Initial value of the attribute `careful`.
        bumper: The robot's bumper says again and again whether it is pressed, so its silence is a fault, as that of a
            range source is. False for a robot without one, or with one that says only what changes.
    Attributes:
        careful: Swing the body while driving so that beams with gaps between them see everything. The camera's picture
            sways with it, so the pilot decides. Without effect on a robot whose profile has no swing.
    """

    def __init__(self, profile: RobotProfile, *, careful: bool = False, bumper: bool = False) -> None:
        self.profile = profile
        self.careful = careful
        self._command_timeout = CommandTimeout(profile.limits)
        self._source_timeouts = {source.name: SourceTimeout(source, profile.limits) for source in profile.sources}
        self._bumper_timeout = BumperTimeout(profile.limits.sensor_timeout if bumper else None)
        self._known_obstacles = KnownObstacles(profile)
        self._shaper = VelocityShaper(profile)
        self._stop_latch = StopLatch()
        self._bumper_latch = BumperLatch()
        self._now = -math.inf
        self._stepped = math.inf
        self._precomputed: TickState | None = None
        self._interruption = ""

    def update_ranges(self, source: str, now: float, ranges: Sequence[float], stamp: float | None = None) -> bool:
        """Take the readings of one source, in the order of its beams.

        Args:
            source: A name from the profile.
            now: [s].
            ranges: [m]; max_range or more where nothing is, UNKNOWN for a beam without a reading.
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
        """Take readings as `update_ranges` does, given as the position of each return in base_link (n, 2) [m]."""
        points = np.asarray(points_in_base, float)
        return self._receive(source, now, stamp, scan_of_points(self.profile.source(source), points))

    def update_bumper(self, now: float, pressed: bool, bearing: float | None = None) -> None:
        """Take the state of the bumpers; a press latches.

        Args:
            now: [s].
            pressed: Whether any of them is pressed.
            bearing: Where, in base_link [rad]; None if the bumper does not report it.
        """
        self._precomputed = None
        self._bumper_timeout.accept(now)
        if not pressed:
            self._bumper_latch.release()
            return
        if self._bumper_latch.pressed and bearing is None:
            return
        heading = self._shaper.heading
        motion = heading[1] if heading is not None and now - heading[0] <= RECENT else None
        bearing = self._known_obstacles.add_bump(now, bearing, motion)
        pose = self._known_obstacles.poses.newest
        self._bumper_latch.press(None if bearing is None or pose is None else bearing + pose.theta)

    @property
    def latched(self) -> Latched:
        """What a person has to reset."""
        return Latched(self._stop_latch.reason, self._bumper_latch.latched)

    def restore(self, latched: Latched) -> None:
        """Take over what was latched in a gate that has died. What was bumped into is forgotten, so every way out of a
        bump is slow."""
        if latched.stopped:
            self.stop(latched.stopped)
        if latched.bumped:
            self._precomputed = None
            self._bumper_latch.restore()

    def stop(self, reason: str) -> None:
        """Stop and stay stopped until `reset_stop`. `reason` completes "Stopped: ..."."""
        self._stop_latch.set(reason)

    def reset_stop(self) -> None:
        """Reset the stop, for a person. The controls must be let go of once before the robot moves again."""
        self._stop_latch.reset()

    def reset_bumper(self) -> bool:
        """Reset the bumper, for a person; what was hit stays remembered. False while a bumper is still pressed."""
        self._precomputed = None
        return self._bumper_latch.reset()

    def forget_surroundings(self) -> None:
        """Drop what is remembered, because the odometry frame is another one from now on: the robot's odometry has
        started again, or somebody has set it."""
        self._precomputed = None
        self._known_obstacles.forget()
        self._bumper_latch.forget_heading()
        self._shaper.forget_heading()
        self._interruption = "Odometry started again: the surroundings must be seen anew."

    def health(self, now: float) -> dict[str, Health]:
        """Return the state of every range source."""
        return {name: timeout.health(now) for name, timeout in self._source_timeouts.items()}

    def obstacles(self) -> np.ndarray:
        """Return the positions of the known obstacles in base_link as of the last tick, shape (n, 2) [m]."""
        if self._known_obstacles.poses.newest is None:
            return np.empty((0, 2))
        return self._known_obstacles.obstacles(self._now)[0]

    def precompute(self, now: float, odometry: Odometry | None) -> None:
        """Take in what the sensors have brought, so that the next `step` need not: that is most of its work, and a
        command waits for it. To be called after updates, on the clock of `step` (its `now` may be a
        little older than that of the last `step`).

        Args:
            now: [s].
            odometry: The newest pose.
        """
        if math.isfinite(now) and odometry is not None and not self._advance_pose(now, odometry):
            self._precomputed = self._tick_state(now, odometry)
            self._precomputed.prepare()

    def step(self, now: float, command: Command | None, odometry: Odometry | None) -> Decision:
        """Decide what to output. Call it at a fixed rate and send every result to the base, zeros too.

        Args:
            now: [s], monotonic; the clock of all stamps.
            command: The newest one; the same object again until a newer one arrives; None if there is none.
            odometry: The newest pose.
        """
        problem = self._interruption or self._advance_clock(now)
        if not problem and not self._command_timeout.offer(now, command):
            problem = self._command_timeout.problem
        problem = problem or self._advance_pose(now, odometry)
        self._interruption = ""
        dt, self._stepped = min(max(now - self._stepped, 0.0), LONGEST_RAMP), now
        if problem or odometry is None:  # a missing odometry is a problem, too
            return self._shaper.halt(State.FAULT, problem, self._command_timeout.age(now), None)
        tick = self._precomputed
        if tick is None or now - tick.now > PRECOMPUTED_MAX_AGE:
            tick = self._tick_state(now, odometry)
        current = self._command_timeout.current(now)
        self._stop_latch.update(current is not None and (current.vx, current.vy, current.wz) != (0.0, 0.0, 0.0))
        age = self._command_timeout.age(now)
        if self._stop_latch.holds:
            return self._shaper.halt(State.STOPPED, self._stop_latch.message, age, tick)
        if not tick.usable:
            return self._shaper.halt(State.SENSOR_STALE, tick.complaint, age, tick)
        if silence := self._bumper_timeout.complaint(now):
            return self._shaper.halt(State.SENSOR_STALE, silence, age, tick)
        if current is None:
            return self._shaper.halt(State.NO_COMMAND, self._command_timeout.problem, age, tick)
        return self._shaper.shape(now, dt, current, age, odometry.theta, tick, self.careful)

    def _receive(self, name: str, now: float, stamp: float | None, scan: Scan | None) -> bool:
        stamp = now if stamp is None else stamp
        accepted = self._source_timeouts[name].accept(now, stamp, scan)
        self._precomputed = None
        if accepted and scan is not None:  # no source accepts a scan that is missing
            self._known_obstacles.add_scan(name, stamp, scan)
        return accepted

    def _tick_state(self, now: float, odometry: Odometry) -> TickState:
        self._known_obstacles.update(now, self._source_timeouts)
        return TickState(
            self.profile, self._source_timeouts, self._known_obstacles, self._bumper_latch, now, odometry.theta
        )

    def _advance_clock(self, now: float) -> str:
        """Take the time. Return what is wrong with it; empty if nothing is."""
        if not math.isfinite(now):
            return "The clock gives no time."
        dt, self._now = now - self._now, now
        if dt < 0.0:
            # What was stamped before would now seem to come from the future.
            self._command_timeout.forget()
            for timeout in self._source_timeouts.values():
                timeout.forget()
            self._bumper_timeout.forget()
            self._known_obstacles.poses.clear()
            self._precomputed = None
            self._interruption = f"The clock went back by {-dt:.2f} s."
            return self._interruption
        return ""

    def _advance_pose(self, now: float, odometry: Odometry | None) -> str:
        """Take the pose. Return what is wrong with it; empty if nothing is."""
        if odometry is None or not odometry.finite:
            return "There is no odometry." if odometry is None else "Odometry holds a value that is not a number."
        if not -AHEAD_OF_TIME <= now - odometry.stamp <= ODOMETRY_MAX_AGE:
            return f"Odometry is {now - odometry.stamp:.1f} s old."
        if odometry is not self._known_obstacles.poses.newest:
            self._precomputed = None
        last = self._known_obstacles.poses.newest
        if not self._known_obstacles.advance(odometry):
            self._shaper.forget_heading()
            if last is not None and odometry.stamp - last.stamp <= LONGEST_TICK:
                self._bumper_latch.turn(odometry.theta - last.theta)
            else:
                self._bumper_latch.forget_heading()
            self._interruption = "Odometry jumped."
            return self._interruption
        self._bumper_latch.move(odometry.x, odometry.y)
        return ""
