"""A simulated Robotino for any world, with its camera and REST in front of it; and a world with one Robotino in it."""

from __future__ import annotations

from robotino_sim.controller import REST_WATCHDOG
from robotino_sim.models import PREFIX, robotino_model
from robotino_sim.robot import Robotino
from robotino_sim.server import create_app
from robotino_sim.webcam import DEFAULT_SIZE, Webcam
from telepresence.mjpeg import WebServer
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulated_robot import SimulatedRobot
from telepresence.sim.simulation import RobotWish
from telepresence.sim.simulation import Simulation as SharedSimulation
from telepresence.sim.world import World

DEFAULT_PORT = 8080
DEFAULT_SCENE = "arena"


class SimulatedRobotino(SimulatedRobot):
    """One Robotino of a world. `robot`, `webcam` and `server` are there once it has entered, and once it serves.

    Args:
        watchdog: Silence after which the motors stop [s].
        laser: Whether the robot carries a laser scanner.
        battery: "NiMH", "Pb" or "Li-Ion".
        camera_size: Of the pictures at /cam0 (width, height) [px].
        strict_camera, cors: See `robotino_sim.server.create_app`.
    """

    DEFAULT_PORT = DEFAULT_PORT

    def __init__(
        self,
        prefix: str = PREFIX,
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        watchdog: float = REST_WATCHDOG,
        laser: bool = False,
        battery: str = "NiMH",
        camera_size: tuple[int, int] = DEFAULT_SIZE,
        strict_camera: bool = False,
        cors: bool = False,
    ) -> None:
        self._model = robotino_model(prefix, offset=offset, laser=laser)
        self._watchdog, self._battery = watchdog, battery
        self._camera_size, self._strict_camera, self._cors = camera_size, strict_camera, cors
        self.robot: Robotino | None = None
        self.webcam: Webcam | None = None
        self.server: WebServer | None = None

    @property
    def model(self) -> RobotModel:
        return self._model

    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        self.robot = Robotino(
            world, cameras, self._model.prefix, seed, watchdog=self._watchdog, battery=self._battery
        )
        self.webcam = Webcam(self.robot, self._camera_size)

    def serve(self, address: str, port: int) -> None:
        app = create_app(self.robot, self.webcam, strict_camera=self._strict_camera, cors=self._cors)
        self.server = WebServer(app, address, port)
        self.server.start()

    @property
    def urls(self) -> list[str]:
        return [self.server.url.rstrip("/")] if self.server else []

    def close(self) -> None:
        if self.server is not None:
            self.server.close()
        if self.webcam is not None:
            self.webcam.close()


class Simulation(SharedSimulation):
    """A world with one Robotino. Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address, port: Where the web server listens; port 0 takes a free one, see `url`.
        start: False leaves the world standing, for programs that step it themselves.
        options: Of `SimulatedRobotino`.
    Raises:
        ValueError: Unknown scene, battery or camera size.
        OSError: The port is taken or the address is not this machine's.
    """

    def __init__(
        self,
        scene: str = DEFAULT_SCENE,
        seed: int = 0,
        address: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        start: bool = True,
        **options: object,
    ) -> None:
        super().__init__([RobotWish("robotino", "robotino", port, options)], scene, seed, address, start=start)

    @property
    def robot(self) -> Robotino:
        return self.robots["robotino"].robot

    @property
    def webcam(self) -> Webcam:
        return self.robots["robotino"].webcam

    @property
    def server(self) -> WebServer:
        return self.robots["robotino"].server

    @property
    def url(self) -> str:
        """Where clients connect, without a slash at the end."""
        return self.urls[0]
