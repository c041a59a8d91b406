"""What the window must know of a kind of robot to show it: shape, reach of its sensors, what it can be asked for."""

from __future__ import annotations

from dataclasses import dataclass

from telepresence.safety.outline import Outline
from telepresence.safety.robot_profile import PEPPER, ROBOTINO


@dataclass(frozen=True)
class Robot:
    """One kind of robot on the screen.

    Args:
        title: What the window calls it.
        outline: Its shape on the floor.
        top_speed, top_turn: As fast as its safety gate ever allows [m/s, rad/s].
        reach: Half the width of the sensor view at first [m].
        farthest_click: Places in the picture farther away than this are driven to in part [m]; by the height of the
            camera: an error of 1 degree moves a place by 0.15 m at 3 m from 1.1 m, and at 2 m from 0.5 m.
        speaks: It says sentences.
        postures: (name, what the button says).
        cameras: (name, topic) of the pictures to choose from, the first is the usual one.
        tablet: Topic of what its tablet shows; None for a robot without one.
        recorded: Topics of a recording, in the robot's namespace.
    """

    title: str
    outline: Outline
    top_speed: float
    top_turn: float
    reach: float
    farthest_click: float
    speaks: bool
    postures: tuple[tuple[str, str], ...]
    cameras: tuple[tuple[str, str], ...]
    tablet: str | None
    recorded: tuple[str, ...]


_RECORDED = ("odom", "safety", "safety_state", "drive_state", "cmd_vel", "/tf", "/tf_static", "/diagnostics")

ROBOTS = {
    "pepper": Robot(
        title="Pepper",
        outline=PEPPER.outline,
        top_speed=PEPPER.limits.max_speed,
        top_turn=PEPPER.limits.max_turn,
        reach=1.8,
        farthest_click=3.0,
        speaks=True,
        postures=(
            ("stand", "Stand"), ("zero", "Arms ahead"), ("crouch", "Crouch"), ("wakeup", "Wake up"), ("rest", "Rest"),
        ),
        cameras=(
            ("Front", "pepper_robot/camera/front/image_raw"),
            ("Floor", "pepper_robot/camera/bottom/image_raw"),
            ("Depth", "pepper_robot/camera/depth/image_raw"),
        ),
        tablet="tablet/image_raw",
        recorded=(
            *_RECORDED, "joint_states", "pepper_robot/laser", "pepper_robot/sonar/front", "pepper_robot/sonar/back",
            "pepper_robot/bumper", "pepper_robot/battery", "pepper_robot/camera/front/image_raw/compressed",
            "pepper_robot/camera/front/camera_info",
        ),
    ),
    "robotino": Robot(
        title="Robotino",
        outline=ROBOTINO.outline,
        top_speed=ROBOTINO.limits.max_speed,
        top_turn=ROBOTINO.limits.max_turn,
        reach=0.9,
        farthest_click=2.0,
        speaks=False,
        postures=(),
        cameras=(),
        tablet=None,
        recorded=(
            *_RECORDED, "safe_cmd_vel", "joint_states", "distance_sensors", "distance_sensors_scan", "scan", "bumper",
            "battery", "image_raw/compressed", "camera_info",
        ),
    ),
}  # fmt: skip
"""By the name of the profile."""
