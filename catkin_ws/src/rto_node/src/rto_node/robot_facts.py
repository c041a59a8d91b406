"""Where Robotino's sensors point and how its wheels turn, as the ROS side knows it. No ROS.

The gate's profile in `telepresence.safety` and the URDF hold the same figures for their own purposes; a test compares.

Sources: the points of distance_sensors, rto_node (dietriro/rto_core, Rahul-K-A/robotino-ros2): 0.2 m around the middle,
0.698 rad apart. The real ring: vendor's api2, 40 degrees apart, counter-clockwise; Webots' Robotino3 model, radius
0.2264 m. Wheels and gear: vendor's controld3.conf and DriveSystem.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

SENSORS = 9
GUIDE_RADIUS, GUIDE_ANGLE, GUIDE_HEIGHT = 0.2, 0.698, 0.05
"""What the Robotino guide takes for the ring: radius [m], angle between sensors (39.99 degrees) [rad], height [m]."""
RING_RADIUS = 0.2264
"""The real ring [m]; the hull has 0.2266 m."""
NEAREST, NOTHING = 0.04, 0.41
"""Smallest and largest reading [m]; the largest means nothing there."""
RING_STEP = math.tau / SENSORS
"""[rad]"""
SCAN_START = -4 * RING_STEP
"""Direction of the first range of `ring_scan`: -160 degrees [rad]."""

LASER_MOUNT = 0.08
"""Where the laser scanner stands, ahead of the middle [m]: URDF of rto_description."""

WHEEL_RADIUS, CENTRE_TO_WHEEL = 0.060, 0.175
"""[m]"""
GEAR = 32.0
"""Turns of a motor for one of its wheel."""
WHEEL_JOINTS = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
"""Joints of the wheels at 60, 180 and 300 degrees."""


CLEARING_POINT = (5.0 * math.cos(0.008727), 5.0 * math.sin(0.008727), GUIDE_HEIGHT)
"""The far end of the only ray, half a degree left of ahead, along which a costmap forgets obstacles, in base_link [m]:
rto_node of dietriro/rto_core, whose 720 points are all this one."""


def guide_points(distances: Sequence[float]) -> list[tuple[float, float, float]]:
    """The guide's points of nine readings, in base_link [m]. "Nothing" is a far point; no reading is none: NaN."""
    return [
        (
            (_measured(distance) + GUIDE_RADIUS) * math.cos(GUIDE_ANGLE * i),
            (_measured(distance) + GUIDE_RADIUS) * math.sin(GUIDE_ANGLE * i),
            GUIDE_HEIGHT,
        )
        for i, distance in enumerate(distances)
    ]


def ranges_of_guide_points(points: Sequence[tuple[float, float]]) -> list[float]:
    """The readings [m] that the guide's points were made from."""
    return [math.hypot(x, y) - GUIDE_RADIUS for x, y in points]


def ring_scan(distances: Sequence[float]) -> list[float]:
    """Ranges from the robot's middle [m], counter-clockwise from `SCAN_START`; infinity where nothing is, minus
    infinity for what is nearer than can be measured, NaN where nothing was measured (REP 117)."""
    behind = len(distances) // 2 + 1
    return [_ring_range(distance) for distance in (*distances[behind:], *distances[:behind])]


def _measured(distance: float) -> float:
    """The reading [m]; NaN for what the robot reports when a sensor has none."""
    return distance if distance >= 0.0 else math.nan


def _ring_range(distance: float) -> float:
    distance = _measured(distance)
    if distance < NEAREST:
        return -math.inf
    return math.inf if distance >= NOTHING else distance + RING_RADIUS


def wheel_speeds(vx: float, vy: float, wz: float) -> tuple[float, float, float]:
    """How fast the wheels turn [rad/s] for a velocity in base_link [m/s, m/s, rad/s]."""
    forward, aside, turn = 0.5 * math.sqrt(3.0) * vx, vy, CENTRE_TO_WHEEL * wz
    return (
        (-forward + 0.5 * aside + turn) / WHEEL_RADIUS,
        (-aside + turn) / WHEEL_RADIUS,
        (forward + 0.5 * aside + turn) / WHEEL_RADIUS,
    )


def motor_speeds(wheels: Sequence[float]) -> list[float]:
    """How fast the motors turn [rpm] for wheels that turn so fast [rad/s]."""
    return [speed * GEAR * 60.0 / math.tau for speed in wheels]
