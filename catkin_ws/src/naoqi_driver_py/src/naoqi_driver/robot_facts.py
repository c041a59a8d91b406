"""Where Pepper's lasers point and how many points they give, as the ROS side knows it. No ROS.

The gate's profile in `telepresence.safety` and the URDF hold the same figures for their own purposes; a test compares.
Sources: NAOqi 2.8 documentation, laser_pep; URDF of ros-naoqi/pepper_robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class FloorFrame(NamedTuple):
    """The frame on the floor under a laser's camera, in which ALMemory gives its points.

    Args:
        side: The camera in ALMemory's keys.
        frame_id: The frame in the URDF.
        x, y, theta: Where it is in base_footprint [m, m, rad].
    """

    side: str
    frame_id: str
    x: float
    y: float
    theta: float


FRONT = FloorFrame("Front", "SurroundingFrontLaser_frame", 0.0562, 0.0, 0.0)
LEFT = FloorFrame("Left", "SurroundingLeftLaser_frame", -0.018, 0.0899, 1.75728)
RIGHT = FloorFrame("Right", "SurroundingRightLaser_frame", -0.018, -0.0899, -1.75728)
SEGMENTS = 15
"""Points of a horizontal line."""
LINE_WIDTH = math.radians(60.0)
"""What a line sees [rad]."""
MIN_RANGE, MAX_RANGE = 0.1, 3.0
"""[m]; 5.6 m in theory, 3 m in practice (softbankrobotics-research/qibullet, laser.py)."""
