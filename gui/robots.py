"""The kinds of robot that the window knows: their topics and services, the command lines that start their programs, and
what the screen must know of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

from gui.ros.channels import Incoming, Offered, Outgoing
from gui.ros.picture import read_picture
from gui.ros.topics import actions, drive, sensors, simulation, station
from gui.terminal import commands
from gui.terminal.commands import Address
from telepresence.safety.outline import Outline
from telepresence.teleop.robot_kinds import PEPPER, ROBOTINO
from telepresence.teleop.robot_readings import camera_info_of

_Row = TypeVar("_Row", Incoming, Outgoing)


@dataclass(frozen=True)
class Robot:
    """One kind of robot.

    Args:
        name: Its key in `ROBOTS`, and its name on the command line.
        title: What the window calls it.
        namespace: The ROS namespace in which the names of topics and services below are resolved.
        cmd_vel: The topic that drives it: of geometry_msgs/Twist, or movement_command.
        session: Makes the command line that starts the robot's programs, of its address and this machine's.
        keyboard: The command line that starts the keyboard program alone; empty if it has none.
        keyboard_name: The name of that program's node, unless another has it.
        incoming, outgoing, services: Its topics and services, see `gui.ros.channels`.
        outline: Its shape on the floor.
        top_speed, top_turn: As fast as its safety gate ever allows [m/s, rad/s].
        reach: Half the width of the sensor view at first [m].
        farthest: A place in the picture farther away than this is driven to in part [m].
        speaks: It says sentences.
        postures: (name, text of the button) of each posture that it can take.
        cameras: (name, topic) of the pictures to choose from, the usual one first; none if there is only one.
        recorded: Topics of a recording.
        filmed: The topic of its pictures in a recording, sensor_msgs/CompressedImage or Image.
        robot_camera: The topic of the simulation guide's picture: it exists if the robot is simulated.
        picture_programs: Last parts of the names of the nodes by whose end its pictures stop, where the pictures' topic
            does not name them.
        by_movement: It takes `movement_command` and nothing else: forward, backward, stop. It is a simulated robot
            without lease, gate and range sensors.
    """

    name: str
    title: str
    namespace: str
    cmd_vel: str
    session: Callable[[Address, str], str]
    keyboard: str
    incoming: tuple[Incoming, ...]
    outgoing: tuple[Outgoing, ...]
    services: tuple[Offered, ...]
    outline: Outline
    top_speed: float
    top_turn: float
    reach: float
    farthest: float
    speaks: bool
    postures: tuple[tuple[str, str], ...]
    cameras: tuple[tuple[str, str], ...]
    recorded: tuple[str, ...]
    filmed: str
    keyboard_name: str = commands.KEYBOARD_NAME
    robot_camera: str = simulation.ROBOT_CAMERA
    picture_programs: tuple[str, ...] = ()
    by_movement: bool = False

    def with_feed(self, topic: str) -> Robot:
        """Return the same robot with another camera topic."""
        topics = {"picture": topic, "lens": camera_info_of(topic)}
        rows = (replace(row, topic=topics.get(row.channel, row.topic)) for row in self.incoming)
        return replace(self, incoming=tuple(rows))

    def among_others(self) -> Robot:
        """Return the same robot in a world with others, where the simulator's own topics are in its namespace, too."""
        own = ("true_pose", "movement")
        return replace(
            self,
            incoming=tuple(_relative(row) if row.channel in own else row for row in self.incoming),
            outgoing=tuple(_relative(row) if row.channel in own else row for row in self.outgoing),
            robot_camera=self.robot_camera.lstrip("/"),
        )

    def lens_of(self, topic: str) -> str:
        """Return the topic of the calibration that belongs to this topic of pictures."""
        if topic == self.robot_camera:
            return next(row.topic for row in self.incoming if row.channel == "lens")  # the first camera, scaled
        return camera_info_of(topic)


def _relative(row: _Row) -> _Row:
    return replace(row, topic=row.topic.lstrip("/"))


def _picture(topic: str, channel: str = "picture") -> Incoming:
    return Incoming(channel, topic, "sensor_msgs/Image", read_picture, on_request=True)


_PEPPER_CAMERAS = (
    ("Front", PEPPER.picture),
    ("Floor", "pepper_robot/camera/bottom/image_raw"),
    ("Depth", "pepper_robot/camera/depth/image_raw"),
)
_RECORDED = ("odom", "safety", "safety_state", "drive_state", "cmd_vel", "/tf", "/tf_static", "/diagnostics")

_PEPPER = Robot(
    name=PEPPER.name,
    title=PEPPER.title,
    namespace=PEPPER.namespace,
    cmd_vel="cmd_vel",
    session=commands.pepper_session,
    keyboard=commands.KEYBOARD,
    incoming=(
        _picture(PEPPER.picture), _picture("tablet/image_raw", "tablet"), *sensors.pepper(), *drive.INCOMING,
        drive.HEAD, simulation.BODY_STATE, station.FAULTS,
    ),
    outgoing=(*drive.outgoing("cmd_vel"), *actions.pepper_outgoing(), simulation.MOVEMENT_REPORT),
    services=(*drive.SERVICES, *actions.pepper_services(), simulation.RESTART),
    outline=PEPPER.profile.outline,
    top_speed=PEPPER.profile.limits.max_speed,
    top_turn=PEPPER.profile.limits.max_turn,
    reach=1.8,
    farthest=PEPPER.farthest,
    speaks=True,
    postures=(
        ("stand", "Stand"), ("zero", "Arms ahead"), ("crouch", "Crouch"), ("wakeup", "Wake up"), ("rest", "Rest"),
    ),
    cameras=_PEPPER_CAMERAS,
    recorded=(
        *_RECORDED, "joint_states", "pepper_robot/laser", "pepper_robot/sonar/front", "pepper_robot/sonar/back",
        "pepper_robot/bumper", PEPPER.battery, f"{PEPPER.picture}/compressed", camera_info_of(PEPPER.picture),
    ),
    filmed=f"{PEPPER.picture}/compressed",
)  # fmt: skip

_ROBOTINO = Robot(
    name=ROBOTINO.name,
    title=ROBOTINO.title,
    namespace=ROBOTINO.namespace,
    cmd_vel="safe_cmd_vel",
    session=commands.robotino_session,
    keyboard=f"{commands.KEYBOARD} cmd_vel:={ROBOTINO.namespace}/safe_cmd_vel",
    incoming=(_picture(ROBOTINO.picture), *sensors.robotino(), *drive.INCOMING, simulation.BODY_STATE, station.FAULTS),
    outgoing=(*drive.outgoing("safe_cmd_vel"), *actions.sound_outgoing(), simulation.MOVEMENT_REPORT),
    services=(*drive.SERVICES, *actions.sound_services(), *actions.careful_services(), simulation.RESTART),
    outline=ROBOTINO.profile.outline,
    top_speed=ROBOTINO.profile.limits.max_speed,
    top_turn=ROBOTINO.profile.limits.max_turn,
    reach=0.9,
    farthest=ROBOTINO.farthest,
    speaks=False,
    postures=(),
    cameras=(),
    recorded=(
        *_RECORDED, "safe_cmd_vel", "joint_states", "distance_sensors", "distance_sensors_scan", "scan", "bumper",
        ROBOTINO.battery, "image_raw/compressed", camera_info_of(ROBOTINO.picture),
    ),
    filmed="image_raw/compressed",
    picture_programs=("rto_camera_receiver", "onboard_camera"),
)  # fmt: skip

_WALKER = Robot(
    name="walker",
    title="Walker",
    namespace="/",
    cmd_vel="movement_command",
    session=commands.walker_session,
    keyboard="",
    incoming=(_picture("robot_camera"), simulation.BODY_STATE, drive.JOY, station.FAULTS),
    outgoing=(simulation.MOVEMENT,),
    services=(simulation.RESTART,),
    outline=Outline.disc(0.28),
    top_speed=0.3,
    top_turn=0.8,
    reach=0.9,
    farthest=0.0,
    speaks=False,
    postures=(),
    cameras=(),
    recorded=("body_state", "movement_command", "truth", "/rosout"),
    filmed="robot_camera",
    by_movement=True,
)

ROBOTS = {robot.name: robot for robot in (_PEPPER, _ROBOTINO, _WALKER)}
"""The robots by name."""
BOTH = ("pepper", "robotino")
"""The robots of a window with two tabs, in the order of the tabs."""
