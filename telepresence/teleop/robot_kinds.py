"""The kinds of robot that people drive: what window and page must both know of them. No ROS, no Qt."""

from __future__ import annotations

from dataclasses import dataclass

from telepresence.safety import robot_profile
from telepresence.safety.robot_profile import RobotProfile


@dataclass(frozen=True)
class RobotKind:
    """One kind of robot.

    Args:
        name: Its key in `KINDS`, and its name on command lines.
        title: What people call it.
        namespace: The ROS namespace in which its topics usually are.
        picture: The topic of its camera's pictures, relative to the namespace; the first one's, if there are several.
        battery: The topic of its battery (sensor_msgs/BatteryState), likewise.
        profile: Its shape and its greatest speeds.
        farthest: A place in the picture farther away than this is driven to in part [m]. It follows from the height of
            the camera: an error of 1 degree moves a place by 0.15 m at 3 m from 1.1 m, and at 2 m from 0.5 m.
    """

    name: str
    title: str
    namespace: str
    picture: str
    battery: str
    profile: RobotProfile
    farthest: float


PEPPER = RobotKind(
    name="pepper",
    title="Pepper",
    namespace="/",
    picture="pepper_robot/camera/front/image_raw",
    battery="pepper_robot/battery",
    profile=robot_profile.PEPPER,
    farthest=3.0,
)
ROBOTINO = RobotKind(
    name="robotino",
    title="Robotino",
    namespace="/rto3",
    picture="img_raw",
    battery="battery",
    profile=robot_profile.ROBOTINO,
    farthest=2.0,
)
KINDS = {kind.name: kind for kind in (PEPPER, ROBOTINO)}
"""The kinds by name."""
