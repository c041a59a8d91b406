"""SimulatedRobot: the interface that every kind of robot implements to be part of a simulated world.

A kind is a subclass, found by name through the entry point group `telepresence.robots` (see setup.py), so that this
package imports none of them. `telepresence.sim.simulation.Simulation` calls its methods in this order:

    robot = SimulatedPepper(prefix="anna/", offset=(0.0, 1.0))     its model is known, nothing runs
    robot.enter(world, cameras, seed)                               the world is built and stands still
    robot.serve("127.0.0.1", 9559)                                  the world runs; the wire answers when this returns
    robot.close()                                                   before cameras and world end
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any, ClassVar, Protocol

from telepresence.geometry import roll_pitch_yaw
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.scene import RobotModel
from telepresence.sim.world import World
from telepresence.teleop.movement import Movement
from telepresence.video.images import LatestImage

ENTRY_POINTS = "telepresence.robots"


class Controls(Protocol):
    """What `robot_control_node` needs from a robot that has no wire of its own. Any thread may call."""

    def move(self, movement: Movement) -> None:
        """Keep this movement until the next call; a restart of the world stops it."""

    def subscribe_camera(self, width: int, height: int, fps: float) -> Feed:
        """Start pictures of the robot's own camera; the caller closes the feed."""


@dataclass(frozen=True)
class BodyState:
    """True pose and velocity of a robot's base.

    Args:
        x, y, z: In the world [m].
        roll, pitch, yaw: [rad].
        velocity: Along the base's own axes x, y, z [m/s].
        turning: Angular velocity about its own axes [rad/s].
    """

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    velocity: tuple[float, float, float]
    turning: tuple[float, float, float]


class SimulatedRobot(ABC):
    """One robot of a world and the wire in front of it.

    Args:
        prefix: Put before every name of the robot in the world, e.g. `"pepper/"`.
        offset: Where it starts relative to the scene's spawn point of its kind (x, y [m]).
        options: Settings of the kind; each subclass names its own.
    """

    DEFAULT_PORT: ClassVar[int | None] = None
    """Port of the wire on a real robot; None for a kind without a wire."""
    BASE_FRAME: ClassVar[str] = "base_link"
    """The frame whose pose is the robot's pose; the model's free joint `root` moves it."""

    controls: Controls | None = None
    """Set by kinds without a wire; the others are controlled through theirs."""
    robot: Any = None
    """The body, in SI units, for code in the same process; set once the robot has entered a world."""
    server: Any = None
    """The wire; set once it serves."""

    @abstractmethod
    def __init__(self, prefix: str, offset: tuple[float, float] = (0.0, 0.0), **options: Any) -> None: ...

    @property
    @abstractmethod
    def model(self) -> RobotModel:
        """The model to build the world with."""

    @abstractmethod
    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        """Connect to the robot's body in `world`, which was built with `model` and does not run yet."""

    def serve(self, address: str, port: int) -> None:  # noqa: B027 -- a robot without a wire has nothing to serve
        """Start to answer the wire; port 0 takes a free one.

        Raises:
            OSError: The port is taken or the address is not this machine's.
        """

    @property
    def urls(self) -> list[str]:
        """Where clients connect, once `serve` has returned."""
        return []

    @property
    def page_url(self) -> str | None:
        """Address of the page that the robot itself serves for its owner, with the key to it; None without one."""
        return None

    @property
    def screens(self) -> Mapping[str, Callable[[], LatestImage]]:
        """Pictures that the robot itself shows, by name: Pepper's tablet."""
        return {}

    def say_nearby(self, text: str) -> None:  # noqa: B027 -- most robots have no microphone
        """Let a person near the robot say a text."""

    def close(self) -> None:  # noqa: B027 -- and nothing to end
        """End the wire and everything else of this robot. Calling it again does nothing."""


def kinds() -> list[str]:
    """Return the names of the kinds of robots that are installed."""
    return sorted(entry_points(group=ENTRY_POINTS).names)


def find_kind(name: str) -> type[SimulatedRobot]:
    """Return the kind called `name`.

    Raises:
        ValueError: There is none; the message names those that exist.
    """
    for entry in entry_points(group=ENTRY_POINTS, name=name):
        return entry.load()
    raise ValueError(f"there is no kind of robot {name!r}; kinds: {', '.join(kinds()) or 'none'}")


def read_pose(world: World, prefix: str) -> BodyState:
    """Return the true pose and velocity of the robot's base, from physics and not from its sensors."""
    joint = world.model.joint(prefix + "root")
    place, motion = int(joint.qposadr[0]), int(joint.dofadr[0])
    with world.locked() as data:
        x, y, z, qw, qx, qy, qz = data.qpos[place : place + 7].tolist()
        linear = data.qvel[motion : motion + 3].copy()
        turning = data.qvel[motion + 3 : motion + 6].tolist()
    # MuJoCo gives a free joint's linear velocity in the world and its angular velocity in the body.
    rows = (
        (1.0 - 2.0 * (qy * qy + qz * qz), 2.0 * (qx * qy + qw * qz), 2.0 * (qx * qz - qw * qy)),
        (2.0 * (qx * qy - qw * qz), 1.0 - 2.0 * (qx * qx + qz * qz), 2.0 * (qy * qz + qw * qx)),
        (2.0 * (qx * qz + qw * qy), 2.0 * (qy * qz - qw * qx), 1.0 - 2.0 * (qx * qx + qy * qy)),
    )
    vx, vy, vz = (float(sum(a * b for a, b in zip(row, linear, strict=True))) for row in rows)
    return BodyState(
        x,
        y,
        z,
        *roll_pitch_yaw(qw, qx, qy, qz),
        velocity=(vx, vy, vz),
        turning=tuple(turning),
    )
