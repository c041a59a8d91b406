"""What the robots publish, as rows of their tables: converts messages to readings. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gui.ros.channels import Incoming
from gui.ros.readings import (
    Beams,
    Bumpers,
    Careful,
    Cone,
    DriveState,
    Levels,
    PageState,
    Points,
    PostureResult,
    VoiceSettings,
    VoiceState,
)
from telepresence.security.outside_text import clean, clean_name
from telepresence.teleop.robot_kinds import PEPPER, ROBOTINO
from telepresence.teleop.robot_readings import (
    camera_info_of,
    read_battery,
    read_lens,
    read_odometry,
    read_safety,
    sane,
)

SUCCEEDED = 3
"""actionlib_msgs/GoalStatus."""
INFRARED_REACH, INFRARED_RADIUS = 0.40, 0.2264
"""Range of Robotino's infrared sensors, radius of their ring [m] (Webots' Robotino3; see rto_node.robot_facts)."""
GUIDE_RADIUS, NOTHING = 0.2, 0.41
"""Radius of the ring in the Robotino guide's points, the reading that means nothing there [m] (likewise)."""
MOST_RAYS, MOST_POINTS, MOST_BEAMS, MOST_DEVICES = 20_000, 2000, 100, 50
"""Rays of a scan, points of it that are painted, beams of a ring, sound devices of a kind; what has more is refused or
thinned out."""
FARTHEST = 100.0
"""What a range sensor sees at most [m]; what is farther is not painted."""


@dataclass(frozen=True)
class Mount:
    """The pose of a sensor in the base frame [m, m, rad]."""

    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0


def scan_points(source: str, mount: Mount = Mount()) -> Callable[[Any, float], Points]:  # noqa: B008
    """Return a function that converts sensor_msgs/LaserScan to `Points`; it raises a ValueError for an absurd scan."""

    def convert(message: Any, arrived: float) -> Points:
        if len(message.ranges) > MOST_RAYS:
            raise ValueError(f"a scan of {len(message.ranges)} rays; {MOST_RAYS} are shown")
        for angle in (message.angle_min, message.angle_increment):
            sane(angle, "the scan")
        ranges = np.asarray(message.ranges, float)
        angles = message.angle_min + message.angle_increment * np.arange(len(ranges)) + mount.theta
        with np.errstate(invalid="ignore"):
            hit = np.isfinite(ranges) & (ranges >= message.range_min) & (ranges <= min(message.range_max, FARTHEST))
        at = np.stack([ranges[hit] * np.cos(angles[hit]), ranges[hit] * np.sin(angles[hit])], axis=1)
        at = at[:: max(1, math.ceil(len(at) / MOST_POINTS))]
        return Points(source, at + np.array((mount.x, mount.y)), arrived)

    return convert


def infrared_ring(message: Any, arrived: float) -> Beams:
    """Convert Robotino's distance_sensors (sensor_msgs/PointCloud) to `Beams` that start at the ring.

    The readings are in its channel "range" [m]. Without that they follow from the points, which the Robotino guide puts
    0.2 m farther out than what they measure.

    Raises:
        ValueError: There are too many.
    """
    readings = next((channel.values for channel in message.channels if channel.name == "range"), None)
    if readings is None:
        readings = [math.hypot(point.x, point.y) - GUIDE_RADIUS for point in message.points]
    if len(readings) > MOST_BEAMS:
        raise ValueError(f"a ring of {len(readings)} beams; {MOST_BEAMS} are shown")
    ranges = np.maximum(np.asarray(readings, float), 0.0)  # NaN stays
    bearings = math.tau / len(ranges) * np.arange(len(ranges)) if len(ranges) else np.zeros(0)
    starts = INFRARED_RADIUS * np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
    return Beams("infrared", starts, bearings, np.where(ranges < NOTHING, ranges, math.inf), INFRARED_REACH, arrived)


def sonar_cone(source: str, mount: Mount) -> Callable[[Any, float], Cone]:
    """Return a function that converts sensor_msgs/Range to `Cone`; it raises a ValueError for an absurd one."""

    def convert(message: Any, arrived: float) -> Cone:
        seen = message.min_range if message.range == -math.inf else message.range
        width, reach = message.field_of_view, min(message.max_range, FARTHEST)
        if not (0.0 <= width <= math.tau and reach >= 0.0) or seen < 0.0:
            raise ValueError("the sonar's range is absurd")
        seen = seen if not math.isfinite(seen) or seen <= FARTHEST else math.inf
        return Cone(source, mount.x, mount.y, mount.theta, width, seen, reach, arrived)

    return convert


class BumperHistory:
    """Converts naoqi_bridge_msgs/Bumper. Each message reports one change; this remembers the other bumpers."""

    NAMES = ("right", "left", "back")

    def __init__(self) -> None:
        self._pressed: set[str] = set()

    def convert(self, message: Any, arrived: float) -> Bumpers:
        if message.bumper >= len(self.NAMES):
            raise ValueError(f"there is no bumper {message.bumper}")
        change = self._pressed.add if message.state else self._pressed.discard
        change(self.NAMES[message.bumper])
        return Bumpers(frozenset(self._pressed), arrived)


def bumper_ring(message: Any, arrived: float) -> Bumpers:
    """Convert the std_msgs/Bool of Robotino's only bumper."""
    return Bumpers(frozenset({"ring"}) if message.data else frozenset(), arrived)


def read_careful(message: Any, _arrived: float) -> Careful:
    """Convert the std_msgs/String of the topic careful.

    Raises:
        ValueError: It is none of the texts that telepresence_ros.careful_switch lists.
    """
    state, _, reason = clean(message.data).partition(": ")
    if state == "unavailable":
        return Careful(False, False, reason)
    word, _, origin = state.partition(" ")
    if word not in ("on", "off") or origin not in ("", "by default"):
        raise ValueError(f"{clean_name(message.data)!r} is no state of the careful scan")
    return Careful(word == "on", bool(origin))


def read_levels(message: Any, arrived: float) -> Levels:
    """Convert a std_msgs/Float32MultiArray: pilot, robot [dBFS].

    Raises:
        ValueError: It does not hold two numbers.
    """
    if len(message.data) != 2:
        raise ValueError(f"two levels are needed, not {len(message.data)}")
    return Levels(float(message.data[0]), float(message.data[1]), arrived)


def read_voice_settings(message: Any, _arrived: float) -> VoiceSettings:
    """Convert a telepresence_msgs/VoiceSettings."""
    return VoiceSettings(
        bool(message.microphone_muted), bool(message.speaker_muted), clean(message.microphone), clean(message.speaker),
        tuple(map(clean, message.microphones[:MOST_DEVICES])), tuple(map(clean, message.speakers[:MOST_DEVICES])),
    )  # fmt: skip


def read_posture_result(message: Any, arrived: float) -> PostureResult:
    """Convert the result of an action."""
    return PostureResult(message.status.status == SUCCEEDED, clean(message.status.text), arrived)


def read_page_state(message: Any, arrived: float) -> PageState:
    """Convert the diagnostic_msgs/DiagnosticStatus of com_cam/status."""
    values = {pair.key: pair.value for pair in message.values}
    wanted = values.get("wanted on tablet") == "True"
    return PageState(clean(message.message), clean(values.get("page", "")), wanted, arrived)


def common() -> tuple[Incoming, ...]:
    """Return the rows that every robot has."""
    return (
        Incoming("body", "odom", "nav_msgs/Odometry", read_odometry),
        Incoming("safety", "safety", "telepresence_msgs/SafetyState", read_safety),
        Incoming(
            "drive_state", "drive_state", "std_msgs/String", lambda message, t: DriveState(clean(message.data), t)
        ),
        Incoming("voice_levels", "voice/levels", "std_msgs/Float32MultiArray", read_levels),
        Incoming(
            "voice_state", "voice/state", "std_msgs/String", lambda message, t: VoiceState(clean(message.data), t)
        ),
        Incoming("voice_settings", "voice/settings", "telepresence_msgs/VoiceSettings", read_voice_settings),
    )


def pepper() -> tuple[Incoming, ...]:
    """Return the rows of Pepper. Source of the mounts: data/frames.csv of pepper_description."""
    return (
        *common(),
        Incoming("laser", "pepper_robot/laser", "sensor_msgs/LaserScan", scan_points("laser")),
        Incoming("sonar_front", "pepper_robot/sonar/front", "sensor_msgs/Range", sonar_cone("front", Mount(0.0699))),
        Incoming(
            "sonar_back", "pepper_robot/sonar/back", "sensor_msgs/Range",
            sonar_cone("back", Mount(-0.0718, 0.0, math.pi)),
        ),
        Incoming("bumper", "pepper_robot/bumper", "naoqi_bridge_msgs/Bumper", BumperHistory().convert),
        Incoming("battery", PEPPER.battery, "sensor_msgs/BatteryState", read_battery),
        Incoming("lens", camera_info_of(PEPPER.picture), "sensor_msgs/CameraInfo", read_lens, on_request=True),
        Incoming("page", "com_cam/status", "diagnostic_msgs/DiagnosticStatus", read_page_state),
        Incoming(
            "posture", "pepper_robot/pose/body_pose/result", "naoqi_bridge_msgs/BodyPoseActionResult",
            read_posture_result,
        ),
    )  # fmt: skip


def robotino() -> tuple[Incoming, ...]:
    """Return the rows of Robotino. Source of the laser's mount: robotino.urdf."""
    return (
        *common(),
        Incoming("infrared", "distance_sensors", "sensor_msgs/PointCloud", infrared_ring),
        Incoming("careful", "careful", "std_msgs/String", read_careful),
        Incoming("laser", "scan", "sensor_msgs/LaserScan", scan_points("laser", Mount(0.08))),
        Incoming("bumper", "bumper", "std_msgs/Bool", bumper_ring),
        Incoming("battery", ROBOTINO.battery, "sensor_msgs/BatteryState", read_battery),
        Incoming("lens", camera_info_of(ROBOTINO.picture), "sensor_msgs/CameraInfo", read_lens, on_request=True),
    )
