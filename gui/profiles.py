"""What differs from robot to robot in the operator's window: topics, and the command lines that start its programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gui import commands
from gui.commands import Address


@dataclass(frozen=True)
class Profile:
    """One kind of robot."""

    feed: str
    """Camera topic, sensor_msgs/Image."""
    cmd_vel: str
    """Where the window drives, geometry_msgs/Twist."""
    session: Callable[[Address, str], str]
    """The command line that starts the robot's programs; from the robot's address and this machine's."""
    keyboard: str
    """The command line that starts the keyboard program alone."""


PROFILES = {
    "pepper": Profile(
        feed="/pepper_robot/camera/front/image_raw",
        cmd_vel="cmd_vel",
        session=commands.pepper_session,
        keyboard=commands.KEYBOARD,
    ),
    "robotino": Profile(
        feed="/rto3/image_raw",
        cmd_vel="/rto3/safe_cmd_vel",
        session=commands.robotino_session,
        keyboard=f"{commands.KEYBOARD} cmd_vel:=/rto3/safe_cmd_vel",
    ),
}
