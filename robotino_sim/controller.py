"""The drive controller: velocity command -> ramps -> motors, and odometry from the motors.

Works as Robotino's controld3 does: a loop of 20 ms slews vx, vy and omega independently, converts them to motor speeds
and clamps each motor on its own, so that saturation bends the path. Without a command for the time of the watchdog the
motors are set to zero at once, past the ramps. Odometry adds up what the motors turned, heading first.

Source: controld3 DriveSystem.cpp, Odometry.cpp and controld3.conf (mirror BusHero/robotino_api2). The 200 ms watchdog
is the REST interface's (wiki.openrobotino.org, Rest api); controld3's own is 500 ms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robotino_sim.kinematics import Triple, body_velocity, motor_speeds
from telepresence.geometry import wrap_angle

CYCLE = 0.020
"""Period of the control loop [s]."""
MAX_LINEAR = 0.8
"""Largest vx and vy [m/s]."""
MAX_ANGULAR = math.pi
"""Largest omega [rad/s]: 180 degrees per second."""
LINEAR_ACCELERATION = 0.4
"""Ramp of vx and of vy, speeding up and slowing down [m/s²]."""
ANGULAR_ACCELERATION = math.pi
"""Ramp of omega, speeding up and slowing down [rad/s²]: 180 degrees per second squared."""
MAX_MOTOR_SPEED = 3000.0
"""[rpm]"""
MOTOR_ACCELERATION = 11500.0
"""[rpm/s]"""
ODOMETRY_PERIOD = 0.050
"""A new odometry reading is published this often [s]: the code gives the configured 50 to a millisecond timer."""
REST_WATCHDOG, CONTROLLER_WATCHDOG = 0.2, 0.5
"""Silence after which the robot stops [s]: what the REST documentation says, and what controld3 does."""
WHEEL_SCALE_ERROR = 0.001
"""Standard deviation of how much a wheel's radius differs from the nominal one, drawn once per run, so that odometry
isn't truth. Nobody has published the real one; lab robots are worse than this."""


@dataclass(frozen=True)
class Odometry:
    """Pose since the start [m, m, rad in [-pi, pi)], velocity in the body's frame [m/s, m/s, rad/s], and a count."""

    x: float = 0.0
    y: float = 0.0
    phi: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    omega: float = 0.0
    seq: int = 0


class DriveController:
    """Everything between a velocity command and three turning motors. Time is an argument; one thread.

    Args:
        watchdog: Silence after which the motors stop [s].
        rng: Draws the wheels' errors; None for perfect wheels.
    """

    def __init__(self, watchdog: float = REST_WATCHDOG, rng: np.random.Generator | None = None) -> None:
        self.watchdog = watchdog
        errors = WHEEL_SCALE_ERROR * rng.standard_normal(3) if rng is not None else np.zeros(3)
        self._wheel_scale = tuple(1.0 + float(error) for error in errors)
        self.reset()

    def reset(self) -> None:
        """Stop, forget the command, and set odometry to its origin and its count to zero."""
        self._command: Triple = (0.0, 0.0, 0.0)
        self._deadline = -math.inf
        self._ramp: Triple = (0.0, 0.0, 0.0)
        self._setpoints: Triple = (0.0, 0.0, 0.0)
        self._motors: Triple = (0.0, 0.0, 0.0)
        self._turned: Triple = (0.0, 0.0, 0.0)  # rpm x s since the last cycle
        self._since_cycle = 0.0
        self._pose = (0.0, 0.0, 0.0)
        self._velocity: Triple = (0.0, 0.0, 0.0)
        self._seq = 0

    @property
    def motors(self) -> Triple:
        """Speeds of the motors now [rpm]."""
        return self._motors

    @property
    def odometry(self) -> Odometry:
        return Odometry(*self._pose, *self._velocity, self._seq)

    @property
    def moving(self) -> bool:
        return any(self._motors) or any(self._setpoints)

    def set_velocity(self, vx: float, vy: float, wz: float, now: float) -> None:
        """Drive at this velocity until the watchdog expires; values beyond the limits are cut, each on its own.

        Args:
            vx, vy, wz: In the body's frame [m/s, m/s, rad/s], finite.
            now: Time of the command [s].
        """
        self._command = (_cut(vx, MAX_LINEAR), _cut(vy, MAX_LINEAR), _cut(wz, MAX_ANGULAR))
        self._deadline = now + self.watchdog

    def keep_alive(self, now: float) -> None:
        """Keep the watchdog from expiring before `now`."""
        self._deadline = max(self._deadline, now)

    def set_odometry(self, x: float, y: float, phi: float) -> None:
        """Set odometry's pose; its count starts again at zero, as the real one's does."""
        self._pose = (x, y, wrap_phi(phi))
        self._seq = 0

    def cycle(self, now: float) -> None:
        """Run one cycle of the control loop; call it every `CYCLE`."""
        if self._since_cycle > 0.0:
            self._integrate()
        if now > self._deadline:
            self._ramp = self._setpoints = (0.0, 0.0, 0.0)
            return
        steps = (LINEAR_ACCELERATION * CYCLE, LINEAR_ACCELERATION * CYCLE, ANGULAR_ACCELERATION * CYCLE)
        vx, vy, wz = (
            state + _cut(wanted - state, step)
            for state, wanted, step in zip(self._ramp, self._command, steps, strict=True)
        )
        self._ramp = (vx, vy, wz)
        m1, m2, m3 = (_cut(speed, MAX_MOTOR_SPEED) for speed in motor_speeds(vx, vy, wz))
        self._setpoints = (m1, m2, m3)

    def turn_motors(self, dt: float) -> Triple:
        """Let the motors follow their setpoints for `dt` seconds; return the body's true velocity over the floor."""
        step = MOTOR_ACCELERATION * dt
        m1, m2, m3 = (
            speed + _cut(wanted - speed, step) for speed, wanted in zip(self._motors, self._setpoints, strict=True)
        )
        self._motors = (m1, m2, m3)
        t1, t2, t3 = self._turned
        self._turned = (t1 + m1 * dt, t2 + m2 * dt, t3 + m3 * dt)
        self._since_cycle += dt
        s1, s2, s3 = self._wheel_scale
        return body_velocity((m1 * s1, m2 * s2, m3 * s3))

    def publish_odometry(self) -> Odometry:
        """Return the next reading; call it every `ODOMETRY_PERIOD`."""
        self._seq += 1
        return self.odometry

    def _integrate(self) -> None:
        dt = self._since_cycle
        t1, t2, t3 = self._turned
        self._velocity = vx, vy, wz = body_velocity((t1 / dt, t2 / dt, t3 / dt))
        x, y, phi = self._pose
        phi = wrap_phi(phi + wz * dt)
        c, s = math.cos(phi), math.sin(phi)
        self._pose = (x + (vx * c - vy * s) * dt, y + (vx * s + vy * c) * dt, phi)
        self._turned = (0.0, 0.0, 0.0)
        self._since_cycle = 0.0


def wrap_phi(angle: float) -> float:
    """Return the same direction as the robot reports it, in [-pi, pi): half a turn is negative."""
    return -wrap_angle(-angle)


def _cut(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
