"""Three omni wheels: velocity of the body <-> speed of the motors.

Wheels 1, 2, 3 stand at 60, 180 and 300 degrees, counter-clockwise from straight ahead. A motor that turns forward
pushes its wheel counter-clockwise around the robot.

Source: Robotino's drive controller, openrobotino SVN (mirror BusHero/robotino_api2), controld3 DriveSystem.cpp and
controld3.conf; api2 OmniDriveModel.h has the same equations.
"""

from __future__ import annotations

import math

WHEEL_RADIUS = 0.060
"""[m]"""
CENTRE_TO_WHEEL = 0.175
"""Distance from the robot's centre to where a wheel touches the floor [m]."""
GEAR = 32.0
"""Motor turns per wheel turn."""
RPM_PER_SPEED = 60.0 * GEAR / (math.tau * WHEEL_RADIUS)
"""Motor speed [rpm] for one metre per second at the wheel's rim."""

_SIN_60 = math.sqrt(3.0) / 2.0

Triple = tuple[float, float, float]


def motor_speeds(vx: float, vy: float, wz: float) -> Triple:
    """Return the speeds of the motors 1, 2, 3 [rpm] for a velocity in the body's frame [m/s, m/s, rad/s]."""
    turn = CENTRE_TO_WHEEL * wz
    return (
        (-_SIN_60 * vx + 0.5 * vy + turn) * RPM_PER_SPEED,
        (-vy + turn) * RPM_PER_SPEED,
        (_SIN_60 * vx + 0.5 * vy + turn) * RPM_PER_SPEED,
    )


def body_velocity(motors: Triple) -> Triple:
    """Return the velocity in the body's frame (vx, vy, wz) [m/s, m/s, rad/s] for motor speeds [rpm]."""
    m1, m2, m3 = (speed / RPM_PER_SPEED for speed in motors)
    vx = (m3 - m1) / math.sqrt(3.0)
    vy = (m1 + m3 - 2.0 * m2) / 3.0
    return vx, vy, (vy + m2) / CENTRE_TO_WHEEL
