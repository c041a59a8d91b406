"""Pepper's two sonars.

Wire: ALMemory keys `Device/SubDeviceList/Platform/{Front,Back}/Sonar/Sensor/Value` [m], ten times a second, alive only
while somebody is subscribed to ALSonar (NAOqi 2.8 documentation, sonar_pep). A cone of 60 degrees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SUBSCRIBER = "ROS"
FIELD_OF_VIEW = 1.05
"""[rad]"""
MIN_RANGE, MAX_RANGE = 0.25, 2.55
"""What the drivers of ros-naoqi publish [m]."""


@dataclass(frozen=True)
class Sonar:
    """One sonar: its ALMemory key, its frame, and the topic it is published on."""

    key: str
    frame_id: str
    topic: str


FRONT = Sonar("Device/SubDeviceList/Platform/Front/Sonar/Sensor/Value", "SonarFront_frame", "sonar/front")
BACK = Sonar("Device/SubDeviceList/Platform/Back/Sonar/Sensor/Value", "SonarBack_frame", "sonar/back")


def to_range(value: object) -> float:
    """A value of ALMemory as sensor_msgs/Range has it [m], after REP 117.

    Infinity when there is nothing up to `MAX_RANGE`, minus infinity when something is too near to measure, NaN when the
    robot has no such sensor.
    """
    if not isinstance(value, int | float) or math.isnan(value):
        return math.nan
    if value > MAX_RANGE:
        return math.inf
    return float(value) if value >= MIN_RANGE else -math.inf
