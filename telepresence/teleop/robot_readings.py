"""What a robot publishes that driving needs, as plain data: odometry, the safety gate, the camera's calibration, the
battery. Window and page read them alike.

Positions are in the robot's base frame on the floor under it (x forward, y left, z up) or in `odom`; SI units;
`arrived` is when the message arrived here [monotonic s]. Messages are read by the names of their fields: no ROS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from telepresence.geometry import roll_pitch_yaw
from telepresence.safety.messages import SECTORS, sector_of
from telepresence.security.outside_text import clean, clean_name

GATE_LIFE = 0.5
"""[s] for which what the safety gate said colours the way to a place, and is shown by the page; it speaks 20 times a
second. Less than `SILENT_AFTER` of `telepresence.station.fault_sentences`: no way is called free beside the sentence
that the gate is gone."""
CHARGING = 1
"""sensor_msgs/BatteryState: power_supply_status."""
LOW_VOLTAGES = {0: 19.0, 1: 19.8, 2: 15.0}
"""sensor_msgs/BatteryState: power_supply_technology -> the voltage [V] below which a Robotino says that its battery is
low, and soon switches off: lead-acid, which has no number there; NiMH; Li-Ion. Source: Robotino's controld3.conf
(mirror BusHero/robotino_api2). A Pepper publishes no voltage."""
LARGEST = 1e5
"""Largest position [m], velocity [m/s, rad/s], voltage [V] and focal length [px] taken from a robot. No robot has more,
and numbers of hundreds of digits do not fit the window."""


def camera_info_of(topic: str) -> str:
    """Return the topic of a camera's calibration: camera_info in the namespace of its pictures (image_transport)."""
    return f"{topic.rpartition('/')[0]}/camera_info" if "/" in topic else "camera_info"


@dataclass(frozen=True)
class Safety:
    """One decision of the safety gate (telepresence_msgs/SafetyState).

    Args:
        state: One or two words, for example "clear", "limited", "blocked".
        reason: A sentence for the pilot.
        allowed: (72,) float [m/s], the speed allowed in each direction, see `SECTORS`.
        gap: Distance to the nearest thing [m]; NaN when unknown.
        sector: The direction of that thing; None when there is none.
        command_age: Age of the newest command at this decision [s].
        given: Velocity that the wheels were given: forward, left [m/s], counter-clockwise [rad/s].
        scanning: Whether the body swings so that the beams see everything.
    """

    state: str
    reason: str
    allowed: np.ndarray
    gap: float
    sector: int | None
    command_age: float
    given: tuple[float, float, float]
    scanning: bool
    arrived: float

    def allowed_towards(self, bearing: float) -> float:
        """Return the speed [m/s] that is allowed in this direction [rad]."""
        return float(self.allowed[sector_of(bearing)])


@dataclass(frozen=True)
class BodyState:
    """Position [m] and attitude [rad] of the body in `frame`, and its velocity in its own frame [m/s, rad/s]."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    vx: float
    vy: float
    wz: float
    frame: str = "odom"
    arrived: float = 0.0


@dataclass(frozen=True)
class Battery:
    """`share` is the charge, 0 to 1, or NaN; `voltage` [V] or NaN."""

    share: float
    voltage: float
    charging: bool
    low: bool
    arrived: float


@dataclass(frozen=True)
class Lens:
    """How a camera maps directions to pixels (sensor_msgs/CameraInfo, without distortion).

    Args:
        fx, fy, cx, cy: Focal lengths and principal point [px].
        width, height: Size of the picture [px].
        frame: The camera's optical frame.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    frame: str = ""


@dataclass(frozen=True)
class CameraView:
    """The pose of a camera at one moment, in a frame whose plane z = 0 is the floor.

    Args:
        rotation: (3, 3) float; columns are the optical axes x right, y down, z ahead, in that frame.
        place: (3,) float [m], the optical centre in that frame.
    """

    lens: Lens
    rotation: np.ndarray = field(repr=False)
    place: np.ndarray


def sane(value: float, what: str) -> float:
    """Return the value if it is finite and no robot's is much larger.

    Raises:
        ValueError: It is not.
    """
    if not abs(value) <= LARGEST:
        raise ValueError(f"{what} holds a value that is not finite, or too large")
    return float(value)


def read_safety(message: Any, arrived: float) -> Safety:
    """Convert a telepresence_msgs/SafetyState.

    Raises:
        ValueError: Its numbers are absurd.
    """
    sector = int(message.sector)
    if len(message.allowed) != SECTORS or not sector < SECTORS or message.gap < 0.0:
        raise ValueError("the safety gate's sectors are absurd")
    return Safety(
        clean_name(message.state),
        clean(message.reason),
        np.asarray(message.allowed, float),
        float(message.gap),
        sector if sector >= 0 else None,
        float(message.command_age),
        (sane(message.vx, "the gate"), sane(message.vy, "the gate"), sane(message.wz, "the gate")),
        bool(message.scanning),
        arrived,
    )


def read_odometry(message: Any, arrived: float) -> BodyState:
    """Convert a nav_msgs/Odometry.

    Raises:
        ValueError: A part of it is not a finite number, or one that no robot has.
    """
    position, q = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    turned = roll_pitch_yaw(q.w, q.x, q.y, q.z)
    numbers = (position.x, position.y, position.z, *turned, linear.x, linear.y, angular.z)
    for number in numbers:
        sane(number, "the odometry")
    return BodyState(*numbers, clean_name(message.header.frame_id).lstrip("/"), arrived)


def read_battery(message: Any, arrived: float) -> Battery:
    """Convert a sensor_msgs/BatteryState; what no battery has counts as unknown."""
    return Battery(
        float(message.percentage) if -0.5 <= message.percentage <= 1.5 else math.nan,
        float(message.voltage) if 0.0 < message.voltage < 1000.0 else math.nan,
        message.power_supply_status == CHARGING,
        0.0 < message.voltage < LOW_VOLTAGES.get(message.power_supply_technology, 0.0),
        arrived,
    )


def read_lens(message: Any, _arrived: float) -> Lens:
    """Convert a sensor_msgs/CameraInfo. The distortion is ignored: it is below one pixel for these cameras.

    Raises:
        ValueError: The camera is not calibrated.
    """
    fx, fy, cx, cy = message.K[0], message.K[4], message.K[2], message.K[5]
    if not (fx > 0.0 and fy > 0.0 and message.width > 0 and message.height > 0):
        raise ValueError("the camera has no calibration")
    for number in (fx, fy, cx, cy, message.width, message.height):
        sane(number, "the calibration")
    return Lens(fx, fy, cx, cy, message.width, message.height, clean_name(message.header.frame_id).lstrip("/"))
