"""Turns the head where the pilot looks. No ROS, no robot, no clock: times are arguments, one step gives what to send.

ALMotion.setAngles (NAOqi 2.8 documentation, control-joint) goes to an angle at a fraction of the joint's top speed, and
stays there. So the head gets an angle a little ahead of where it should be, at the speed it should have: it turns
evenly from step to step, and `AHEAD_TIME` after the last one it stands, whatever became of us.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from telepresence.geometry import Velocity
from telepresence.teleop.looking import VALID, Look, Manner

JOINTS = ("HeadYaw", "HeadPitch")
TOP_SPEED = (7.33998, 9.22756)
"""Top speed of each joint [rad/s] (URDF of ros-naoqi/pepper_robot); `setAngles` takes fractions of it."""
LARGEST_YAW = 2.08567
_YAWS = np.radians((0.0, 33.3, 61.6, 91.4, 119.5))
_HIGHEST = np.radians((-40.5, -40.5, -35.2, -35.1, -35.0))
_LOWEST = np.radians((25.5, 25.5, 20.9, 13.5, 13.5))
"""How far the head nods up and down depends on how far it is turned: beyond, the shell of the neck is in the way (NAOqi
2.8 documentation, joints_pep)."""
FASTEST = (2.5, 2.0)
"""How fast a pilot turns the head [rad/s]: a drag across the picture in a third of a second."""
CALM = (1.2, 0.8)
"""How fast it turns by itself, to straight ahead or where the robot drives [rad/s]."""
NEARING = 8.0
"""[1/s]: speed per radian that is left to turn; below 1 / `AHEAD_TIME`, or it would go beyond."""
NEAR = 0.005
"""[rad]; nearer to a goal than this the head is there."""
AHEAD_TIME = 0.12
"""Seconds for which the head goes on without a further step: two periods and some delay."""
LONGEST_STEP = 0.15
"""Seconds; what is longer was a pause."""
SLOWEST = 0.03
"""Robots standing still or slower [m/s, rad/s] drive nowhere."""
PATIENCE = 1.0
"""Seconds for which the head stays aside after the robot has driven there."""
LEAD = 0.6
"""Seconds of a turn that the head looks ahead."""
MOST_LEAD = 0.6
"""[rad]"""


class Step(NamedTuple):
    """What to send to one joint: `setAngles(joint, angle, fraction)`."""

    joint: str
    angle: float
    fraction: float


class HeadLimits(NamedTuple):
    """How far the head nods at a yaw [rad]; up is negative."""

    up: float
    down: float


def limits_at(yaw: float) -> HeadLimits:
    """Return how far the head nods at a yaw [rad]."""
    return HeadLimits(float(np.interp(abs(yaw), _YAWS, _HIGHEST)), float(np.interp(abs(yaw), _YAWS, _LOWEST)))


def reachable(yaw: float, pitch: float) -> tuple[float, float]:
    """Return the angles nearest to these [rad] that the head can have: the yaw counts first."""
    yaw = max(-LARGEST_YAW, min(LARGEST_YAW, yaw))
    up, down = limits_at(yaw)
    return yaw, max(up, min(down, pitch))


def yaw_of_way(velocity: Velocity) -> float | None:
    """Return the yaw [rad] at which the head sees where a robot drives; None while it drives nowhere.

    It turns ahead of a turn. What is behind it cannot see: driving backwards it looks ahead, as a driver does who
    trusts the mirrors; the gate's ring shows what is there.
    """
    vx, vy, wz = velocity
    moving = math.hypot(vx, vy) > SLOWEST
    if not moving and abs(wz) <= SLOWEST:
        return None
    lead = max(-MOST_LEAD, min(MOST_LEAD, LEAD * wz))
    if not moving:
        return lead
    backwards = vx < 0.0 and abs(vy) < abs(vx)
    return lead if backwards else math.atan2(vy, vx) + lead


class HeadMotion:
    """Where the head should be, step by step.

    Args:
        ahead: Pitch of looking straight ahead [rad, positive down].
    """

    def __init__(self, ahead: float) -> None:
        self._ahead = ahead
        self._look: tuple[Look, float] | None = None
        self._velocity, self._velocity_at = Velocity(0.0, 0.0, 0.0), -math.inf
        self._drove_at, self._way = -math.inf, 0.0
        self._angles: tuple[float, float] | None = None
        self._at = -math.inf
        self._moving = False

    @property
    def needs_angles(self) -> bool:
        """Whether it has to be told by `place` where the head is, before it can turn it."""
        return self._angles is None

    def look(self, look: Look, now: float) -> None:
        """Take where the pilot wants to look."""
        self._look = look, now

    def drives(self, velocity: Velocity, now: float) -> None:
        """Take the velocity that is commanded."""
        self._velocity, self._velocity_at = velocity, now

    def looks(self, now: float) -> bool:
        """Whether somebody looks around."""
        return self._look is not None and now - self._look[1] <= VALID

    def place(self, yaw: float, pitch: float) -> None:
        """Take where the head is [rad], measured."""
        self._angles = yaw, pitch

    def forget(self) -> None:
        """The head may be anywhere by the next look: nobody looks around any more, or the link was lost."""
        self._look, self._angles, self._moving = None, None, False

    def step(self, now: float) -> list[Step]:
        """Return what to send now; nothing while the head stays. To be called on each look and every 0.05 s."""
        elapsed, self._at = min(now - self._at, LONGEST_STEP), now
        if self._angles is None:
            return []
        speeds = self._speeds(now)
        if not any(speeds):
            if not self._moving:
                return []
            self._moving = False
            return [Step(joint, angle, fraction(CALM[n], n)) for n, (joint, angle) in self._joints(self._angles)]
        if not self._moving:
            elapsed = 0.0  # it stood until now
        self._moving = True
        self._angles = reachable(*(at + v * elapsed for at, v in zip(self._angles, speeds, strict=True)))
        ends = reachable(*(at + v * AHEAD_TIME for at, v in zip(self._angles, speeds, strict=True)))
        return [
            Step(joint, end, fraction(abs(end - self._angles[n]) / AHEAD_TIME, n))
            for n, (joint, end) in self._joints(ends)
            if end != self._angles[n]
        ]

    def _joints(self, angles: tuple[float, float]) -> list[tuple[int, tuple[str, float]]]:
        return list(enumerate(zip(JOINTS, angles, strict=True)))

    def _speeds(self, now: float) -> tuple[float, float]:
        """How fast to turn [rad/s]."""
        if self._look is None or not self.looks(now):
            return 0.0, 0.0
        look = self._look[0]
        if look.manner is Manner.RATE:
            yaw, pitch = (max(-most, min(most, rate)) for rate, most in zip(look[1:], FASTEST, strict=True))
            return yaw, pitch
        goal, most = self._goal(look, now)
        return self._speed_to(goal, most, 0), self._speed_to(goal, most, 1)

    def _goal(self, look: Look, now: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where to, and how fast at most."""
        if look.manner is Manner.GOAL:
            return reachable(look.yaw, look.pitch), FASTEST
        if look.manner is Manner.AHEAD:
            return reachable(0.0, self._ahead), FASTEST
        way = yaw_of_way(self._velocity) if now - self._velocity_at <= VALID else None
        if way is not None:
            self._drove_at, self._way = now, way
        elif now - self._drove_at > PATIENCE:
            self._way = 0.0
        return reachable(self._way, self._ahead), CALM

    def _speed_to(self, goal: tuple[float, float], most: tuple[float, float], n: int) -> float:
        assert self._angles is not None
        left = goal[n] - self._angles[n]
        return 0.0 if abs(left) < NEAR else max(-most[n], min(most[n], NEARING * left))


def fraction(speed: float, joint: int) -> float:
    """Return the part of a joint's top speed; never so little that it would not get there."""
    return max(0.01, min(1.0, speed / TOP_SPEED[joint]))
