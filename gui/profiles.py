"""What differs from robot to robot in the operator's window: topics, services, and the command lines that start its
programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gui.ros.channels import Incoming, Offered, Outgoing
from gui.ros.picture import read_picture
from gui.ros.topics import actions, drive, sensors
from gui.terminal import commands
from gui.terminal.commands import Address


@dataclass(frozen=True)
class Profile:
    """One kind of robot. Names in the tables are resolved in `namespace`."""

    name: str
    namespace: str
    cmd_vel: str
    """Where the robot listens for velocities, geometry_msgs/Twist."""
    session: Callable[[Address, str], str]
    """The command line that starts the robot's programs; from the robot's address and this machine's."""
    keyboard: str
    """The command line that starts the keyboard program alone."""
    incoming: tuple[Incoming, ...]
    outgoing: tuple[Outgoing, ...]
    services: tuple[Offered, ...]

    def with_feed(self, topic: str) -> Profile:
        """The same robot with another camera topic."""
        topics = {"picture": topic, "lens": camera_info_of(topic)}
        rows = (replace(row, topic=topics.get(row.channel, row.topic)) for row in self.incoming)
        return replace(self, incoming=tuple(rows))


def camera_info_of(topic: str) -> str:
    """Where a camera tells how it maps directions to pixels: beside its pictures (ROS package image_transport)."""
    return f"{topic.rpartition('/')[0]}/camera_info" if "/" in topic else "camera_info"


def _picture(topic: str, channel: str = "picture") -> Incoming:
    return Incoming(channel, topic, "sensor_msgs/Image", read_picture, on_wish=True)


PROFILES = {
    "pepper": Profile(
        name="pepper",
        namespace="/",
        cmd_vel="cmd_vel",
        session=commands.pepper_session,
        keyboard=commands.KEYBOARD,
        incoming=(
            _picture("pepper_robot/camera/front/image_raw"),
            _picture("tablet/image_raw", "tablet"),
            *sensors.pepper(),
            *drive.INCOMING,
        ),
        outgoing=(
            *drive.outgoing("cmd_vel"),
            *actions.pepper_outgoing(),
        ),
        services=(*drive.SERVICES, *actions.pepper_services()),
    ),
    "robotino": Profile(
        name="robotino",
        namespace="/rto3",
        cmd_vel="safe_cmd_vel",
        session=commands.robotino_session,
        keyboard=f"{commands.KEYBOARD} cmd_vel:=/rto3/safe_cmd_vel",
        incoming=(_picture("img_raw"), *sensors.robotino(), *drive.INCOMING),
        outgoing=(*drive.outgoing("safe_cmd_vel"), *actions.sound_outgoing()),
        services=(*drive.SERVICES, *actions.sound_services()),
    ),
}
