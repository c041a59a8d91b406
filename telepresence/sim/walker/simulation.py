"""A simulated walker for any world, with its web server; and a world with one walker."""

from __future__ import annotations

from telepresence.mjpeg import WebServer
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulated_robot import Movement, SimulatedRobot
from telepresence.sim.simulation import RobotWish
from telepresence.sim.simulation import Simulation as SharedSimulation
from telepresence.sim.walker.body import PREFIX, walker_model
from telepresence.sim.walker.gait import TROT
from telepresence.sim.walker.robot import WATCHDOG, Walker
from telepresence.sim.walker.server import create_app
from telepresence.sim.world import World

DEFAULT_PORT = 8090
DEFAULT_SCENE = "flat"


class WalkerControls:
    """What `robot_control_node` needs of a walker: a gait that goes on until it is told to freeze."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker

    def move(self, movement: Movement) -> None:
        """Walk forward or backward at the gait's own speed until told otherwise, or freeze."""
        self._walker.move({Movement.FORWARD: 1, Movement.BACKWARD: -1}.get(movement, 0))

    def subscribe_camera(self, width: int, height: int, fps: float) -> Feed:
        return self._walker.subscribe_camera(width, height, fps)


class SimulatedWalker(SimulatedRobot):
    """One walker of a world. `robot` and `server` are there once it has entered, and once it serves.

    Args:
        gait: "trot" or "crawl".
        watchdog: Silence after which a walker that is driven by its web server freezes [s].
        hold_heading: See `telepresence.sim.walker.robot.Walker`.
    """

    DEFAULT_PORT = DEFAULT_PORT

    def __init__(
        self,
        prefix: str = PREFIX,
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        gait: str = TROT.name,
        watchdog: float = WATCHDOG,
        hold_heading: bool = True,
    ) -> None:
        self._model = walker_model(prefix, offset=offset)
        self._gait, self._watchdog, self._hold_heading = gait, watchdog, hold_heading
        self.robot: Walker | None = None
        self.server: WebServer | None = None

    @property
    def model(self) -> RobotModel:
        return self._model

    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        self.robot = Walker(
            world,
            cameras,
            self._model.prefix,
            seed,
            gait=self._gait,
            watchdog=self._watchdog,
            hold_heading=self._hold_heading,
        )
        self.controls = WalkerControls(self.robot)

    def serve(self, address: str, port: int) -> None:
        self.server = WebServer(create_app(self.robot), address, port)
        self.server.start()

    @property
    def urls(self) -> list[str]:
        return [self.server.url.rstrip("/")] if self.server else []

    def close(self) -> None:
        if self.server is not None:
            self.server.close()


class Simulation(SharedSimulation):
    """A world with one walker. Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address, port: Where the web server listens; port 0 takes a free one, see `url`.
        start: False leaves the world standing, for programs that step it themselves.
        options: Of `SimulatedWalker`.
    Raises:
        ValueError: Unknown scene or gait.
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
        super().__init__([RobotWish("walker", "walker", port, options)], scene, seed, address, start=start)

    @property
    def robot(self) -> Walker:
        return self.robots["walker"].robot

    @property
    def url(self) -> str:
        """Where clients connect, without a slash at the end."""
        return self.urls[0]
