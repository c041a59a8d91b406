"""What differs from robot to robot in the operator's window: topics, services, and the command lines that start its
programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gui import commands
from gui.channels import Incoming, Offered, Outgoing
from gui.commands import Address
from gui.picture import read_picture


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
        rows = (replace(row, topic=topic) if row.channel == "picture" else row for row in self.incoming)
        return replace(self, incoming=tuple(rows))


def _picture(topic: str) -> Incoming:
    return Incoming("picture", topic, "sensor_msgs/Image", read_picture, on_wish=True)


def _fill_twist(message: object, vx: float, vy: float, wz: float) -> None:
    message.linear.x, message.linear.y, message.angular.z = vx, vy, wz


PROFILES = {
    "pepper": Profile(
        name="pepper",
        namespace="/",
        cmd_vel="cmd_vel",
        session=commands.pepper_session,
        keyboard=commands.KEYBOARD,
        incoming=(_picture("pepper_robot/camera/front/image_raw"),),
        outgoing=(Outgoing("drive", "cmd_vel", "geometry_msgs/Twist", _fill_twist),),
        services=(Offered("restart_simulation", "restart_simulation"),),
    ),
    "robotino": Profile(
        name="robotino",
        namespace="/rto3",
        cmd_vel="safe_cmd_vel",
        session=commands.robotino_session,
        keyboard=f"{commands.KEYBOARD} cmd_vel:=/rto3/safe_cmd_vel",
        incoming=(_picture("img_raw"),),
        outgoing=(Outgoing("drive", "safe_cmd_vel", "geometry_msgs/Twist", _fill_twist),),
        services=(Offered("restart_simulation", "restart_simulation"),),
    ),
}
