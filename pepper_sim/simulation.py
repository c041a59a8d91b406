"""A simulated Pepper for any world, with its tablet and NAOqi in front of it; and a world with one Pepper in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pepper_sim.models import PREFIX, pepper_model
from pepper_sim.robot import Pepper
from pepper_sim.server import NaoqiServer
from pepper_sim.sound import Room
from pepper_sim.tablet import Tablet
from telepresence.images import LatestImage
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulated_robot import SimulatedRobot
from telepresence.sim.simulation import RobotWish
from telepresence.sim.simulation import Simulation as SharedSimulation
from telepresence.sim.world import World

DEFAULT_PORT = 9559
DEFAULT_SCENE = "apartment"


class SimulatedPepper(SimulatedRobot):
    """One Pepper of a world. `robot`, `tablet` and `server` are there once it has entered, and once it serves."""

    DEFAULT_PORT = DEFAULT_PORT
    BASE_FRAME = "base_footprint"

    def __init__(self, prefix: str = PREFIX, offset: tuple[float, float] = (0.0, 0.0)) -> None:
        self._model = pepper_model(prefix, offset=offset)
        self._seed = 0
        self.robot: Pepper | None = None
        self.tablet: Tablet | None = None
        self.server: NaoqiServer | None = None

    @property
    def model(self) -> RobotModel:
        return self._model

    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        self._seed = seed
        self.robot = Pepper(world, cameras, self._model.prefix, seed)
        self.tablet = Tablet(self.robot.show_on_tablet)

    def serve(self, address: str, port: int) -> None:
        self.server = NaoqiServer(self.robot, f"tcp://{address}:{port}", self.tablet, self._seed)

    @property
    def urls(self) -> list[str]:
        return self.server.endpoints if self.server else []

    @property
    def screens(self) -> Mapping[str, Callable[[], LatestImage]]:
        return {"tablet": lambda: self.tablet.image}

    def close(self) -> None:
        if self.server is not None:
            self.server.close()
        if self.tablet is not None:
            self.tablet.close()


class Simulation(SharedSimulation):
    """A world with one Pepper. Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address, port: Where NAOqi listens; port 0 takes a free one, see `url`.
    Raises:
        ValueError: Unknown scene.
        CannotListen: The port is taken or the address is not this machine's.
    """

    def __init__(
        self, scene: str = DEFAULT_SCENE, seed: int = 0, address: str = "127.0.0.1", port: int = DEFAULT_PORT
    ) -> None:
        super().__init__([RobotWish("pepper", "pepper", port)], scene, seed, address)

    @property
    def robot(self) -> Pepper:
        return self.robots["pepper"].robot

    @property
    def tablet(self) -> Tablet:
        return self.robots["pepper"].tablet

    @property
    def server(self) -> NaoqiServer:
        return self.robots["pepper"].server

    @property
    def url(self) -> str:
        """Where clients connect: the first endpoint."""
        return self.urls[0]

    @property
    def room(self) -> Room:
        """What the robot hears and plays: play a sound into `room.surroundings`, listen to `room.loudspeaker.track`."""
        return self.server.catalogue.room
