"""The gait: a phase that runs, four feet that take turns by it. Pure; time and attitude are arguments.

A foot on the ground moves backward under the trunk as fast as the trunk is to move forward; a foot in the air swings
from where it left the ground to where the middle of its next time on the ground will be under its hip. So starting,
turning, changing direction and stopping in mid-step need no special poses: `freeze` leaves the feet that stand where
they are and puts the others straight down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from telepresence.sim.walker.kinematics import FOOT_RADIUS, HIPS, OFFSET, SIDE

HEIGHT = 0.185
"""Of the trunk's middle over the ground [m]."""
STANCE = HIPS + np.stack([np.full(4, -0.020), 1.15 * OFFSET * SIDE, np.full(4, FOOT_RADIUS - HEIGHT)], axis=1)
"""Feet of the standing robot in the trunk's frame (4, 3) [m], so far behind the hips that it trots forward as
fast as backward."""
ACCELERATION = np.array([0.6, 0.6, 3.0])
"""[m/s², m/s², rad/s²]"""
LANDING = 0.10
"""A frozen robot puts lifted feet down within this time [s]."""
FARTHEST = 0.075
"""A foot goes no farther than this from under its hip [m]."""
LEVELLING = 0.35
"""Share of the trunk's tilt that the legs counter by their length."""


@dataclass(frozen=True)
class Gait:
    """In which order and for how long feet are lifted.

    Args:
        name: For people.
        frequency: Steps of each foot per second [Hz].
        duty: Share of a period that a foot is on the ground.
        offsets: When in the period each foot touches down, in the order of `kinematics.LEGS`.
        lift: Height of a step [m].
        cruise: Speed of plain walking, forward or backward [m/s].
        top_speed: Of the trunk, forward and sideways [m/s, m/s], and turning [rad/s].
        sway: How far the trunk leans over the feet that stand, sideways [m].
        lead: How much earlier than the lifting of the feet, as a share of the period.
    """

    name: str
    frequency: float
    duty: float
    offsets: tuple[float, float, float, float]
    lift: float
    cruise: float
    top_speed: tuple[float, float, float]
    sway: float = 0.0
    lead: float = 0.0


TROT = Gait("trot", 2.6, 0.64, (0.0, 0.5, 0.5, 0.0), 0.035, 0.25, (0.30, 0.10, 0.8))
"""Diagonal feet together: quick, and on two feet most of the time."""
CRAWL = Gait("crawl", 0.9, 0.80, (0.25, 0.75, 0.0, 0.5), 0.035, 0.08, (0.09, 0.04, 0.35), sway=0.022, lead=0.08)
"""One foot at a time, the trunk over the other three: slow, and it could stop at any instant."""
GAITS = {gait.name: gait for gait in (TROT, CRAWL)}


class GaitController:
    """Decides where the feet go. One thread."""

    def __init__(self, gait: Gait = TROT) -> None:
        self.gait = gait
        self.next = gait
        self.reset()

    def reset(self) -> None:
        """Stand at phase 0 with every foot at its place in `STANCE`."""
        self.gait = self.next
        self.phase = 0.0
        self.walking = False
        self.velocity = np.zeros(3)
        self.feet = STANCE.copy()
        self.lifted: np.ndarray = np.zeros(4, bool)
        self._from = STANCE[:, :2].copy()
        self._lean = 0.0
        self._tilt = (0.0, 0.0)

    def choose(self, gait: Gait) -> None:
        """Walk so from the next start on; at once if the robot stands."""
        self.next = gait
        if not self.walking:
            self.gait = gait

    def freeze(self) -> None:
        """Stop now: standing feet keep their places, lifted ones are put down where they are."""
        self.walking = False
        self.velocity[:] = 0.0

    def step(self, wanted: np.ndarray, dt: float, tilt: tuple[float, float]) -> np.ndarray:
        """One tick.

        Args:
            wanted: Velocity of the trunk (vx, vy [m/s], wz [rad/s]), cut to what the gait can do; zeros freeze it.
            dt: [s].
            tilt: Roll and pitch [rad].
        Returns:
            Feet in the trunk's frame, shape (4, 3) [m].
        """
        if not np.any(wanted):
            if self.walking:
                self.freeze()
            self._lower(dt)
            self.lifted &= self.feet[:, 2] > STANCE[:, 2]
        else:
            self._walk(wanted, dt)
        return self._levelled(tilt)

    def _walk(self, wanted: np.ndarray, dt: float) -> None:
        gait = self.gait
        if not self.walking:
            self.gait = gait = self.next
            self.walking = True
            self.phase = 0.0
        wanted = np.clip(wanted, np.negative(gait.top_speed), gait.top_speed)
        self.velocity += np.clip(wanted - self.velocity, -ACCELERATION * dt, ACCELERATION * dt)
        self.phase = (self.phase + gait.frequency * dt) % 1.0
        # A leg's own phase: 0 touches down, `duty` lifts off.
        own = (self.phase - np.array(gait.offsets)) % 1.0
        swing = np.where(own >= gait.duty, (own - gait.duty) / (1.0 - gait.duty), 0.0)
        lifted = own >= gait.duty
        leaving = lifted & ~self.lifted
        self._from[leaving] = self.feet[leaving, :2]
        self.lifted = lifted
        over_ground = self._ground_velocity()
        self.feet[~lifted, :2] -= over_ground[~lifted] * dt
        target = STANCE[:, :2] + 0.5 * gait.duty / gait.frequency * over_ground
        run = -over_ground * (1.0 - gait.duty) / gait.frequency
        self.feet[lifted, :2] = _swing(self._from, target, run, swing)[lifted]
        offset = np.clip(self.feet[:, :2] - STANCE[:, :2], -FARTHEST, FARTHEST)
        self.feet[:, :2] = STANCE[:, :2] + offset
        self._lower(dt)
        self.feet[lifted, 2] = (STANCE[:, 2] + gait.lift * np.sin(math.pi * swing) ** 2)[lifted]
        self._lean_over(dt)

    def _ground_velocity(self) -> np.ndarray:
        """Velocity of the trunk above each foot (4, 2) [m/s]."""
        vx, vy, wz = self.velocity
        x, y = self.feet[:, 0], self.feet[:, 1]
        return np.stack([vx - wz * y, vy + wz * x], axis=1)

    def _lean_over(self, dt: float) -> None:
        """Shift the trunk over the feet that stand, ahead of the lifting."""
        gait = self.gait
        if not gait.sway:
            self._lean = 0.0
            return
        own = (self.phase + gait.lead - np.array(gait.offsets)) % 1.0
        weight = np.where(own >= gait.duty, np.sin(math.pi * (own - gait.duty) / (1.0 - gait.duty)), 0.0)
        wanted = -gait.sway * float(weight @ SIDE)
        self._lean += (wanted - self._lean) * min(1.0, dt / 0.06)

    def _lower(self, dt: float) -> None:
        self.feet[:, 2] = np.maximum(self.feet[:, 2] - self.gait.lift / LANDING * dt, STANCE[:, 2])

    def _levelled(self, tilt: tuple[float, float]) -> np.ndarray:
        """The feet with the trunk's lean, and longer legs on the side that sinks; as they were, once frozen."""
        if self.walking:
            self._tilt = tilt
        roll, pitch = self._tilt
        feet = self.feet.copy()
        feet[:, 1] -= self._lean
        feet[:, 2] += LEVELLING * (roll * feet[:, 1] - pitch * feet[:, 0])
        return feet


def _swing(start: np.ndarray, end: np.ndarray, run: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Where feet in the air are, shape (4, 2): cubic, with the ground's velocity at both ends so that none scuffs.

    Args:
        start, end: Where they left the ground and will meet it (4, 2) [m].
        run: How far the ground moves under the trunk meanwhile (4, 2) [m].
        share: Of the swing that is over, shape (4,).
    """
    s = share[:, None]
    return start + (end - start) * s * s * (3.0 - 2.0 * s) + run * s * (1.0 - s) * (1.0 - 2.0 * s)
