"""A simulated Robotino for any world, with its camera and REST in front of it; and a world with one Robotino in it."""

from __future__ import annotations

from robotino_sim.controller import REST_WATCHDOG
from robotino_sim.models import PREFIX, robotino_model
from robotino_sim.robot import Robotino
from robotino_sim.server import create_app
from robotino_sim.webcam import DEFAULT_SIZE, Webcam
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulation import OneRobotSimulation
from telepresence.sim.web_robot import WebRobot
from telepresence.sim.world import World
from telepresence.web.json_app import Application

DEFAULT_PORT = 8080
DEFAULT_SCENE = "arena"


class SimulatedRobotino(WebRobot):
    """One Robotino of a world. `robot` and `webcam` are set once it has entered, `server` once it serves.

    Args:
        watchdog: Silence after which the motors stop [s].
        laser: Whether the robot carries a laser scanner.
        battery: "NiMH", "Pb" or "Li-Ion"; only the last one's packs have a Festool charger.
        charging: Whether it stands at the charger from the start.
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
        charging: bool = False,
        camera_size: tuple[int, int] = DEFAULT_SIZE,
        strict_camera: bool = False,
        cors: bool = False,
    ) -> None:
        self._model = robotino_model(prefix, offset=offset, laser=laser)
        self._watchdog, self._battery, self._charging = watchdog, battery, charging
        self._camera_size, self._strict_camera, self._cors = camera_size, strict_camera, cors
        self.robot: Robotino | None = None
        self.webcam: Webcam | None = None

    @property
    def model(self) -> RobotModel:
        return self._model

    def enter(self, world: World, cameras: Cameras, seed: int) -> None:
        self.robot = Robotino(
            *(world, cameras, self._model.prefix, seed),
            watchdog=self._watchdog,
            battery=self._battery,
            charging=self._charging,
        )
        self.webcam = Webcam(self.robot, self._camera_size)

    def create_app(self) -> Application:
        if self.robot is None or self.webcam is None:
            raise RuntimeError("the Robotino has not entered a world yet")
        return create_app(self.robot, self.webcam, strict_camera=self._strict_camera, cors=self._cors)

    def close(self) -> None:
        super().close()
        if self.webcam is not None:
            self.webcam.close()


class Simulation(OneRobotSimulation):
    """A world with one Robotino; the options are those of `SimulatedRobotino`."""

    KIND, SCENE = "robotino", DEFAULT_SCENE

    @property
    def webcam(self) -> Webcam:
        return self.simulated.webcam
