"""A simulated walker for any world, with its web server; and a world with one walker."""

from __future__ import annotations

from telepresence import ports
from telepresence.sim.camera import Cameras, Feed
from telepresence.sim.scene import RobotModel
from telepresence.sim.simulation import OneRobotSimulation
from telepresence.sim.walker.body import PREFIX, walker_model
from telepresence.sim.walker.gait import TROT
from telepresence.sim.walker.robot import WATCHDOG, Walker
from telepresence.sim.walker.server import create_app
from telepresence.sim.web_robot import WebRobot
from telepresence.sim.world import World
from telepresence.teleop.movement import Movement
from telepresence.web.json_app import Application

DEFAULT_PORT = ports.WALKER
DEFAULT_SCENE = "flat"


class WalkerControls:
    """Controls a walker for `robot_control_node`: the gait continues until it is stopped."""

    def __init__(self, walker: Walker) -> None:
        self._walker = walker

    def move(self, movement: Movement) -> None:
        """Walk forward or backward at the gait's own speed until the next call, or freeze."""
        self._walker.move({Movement.FORWARD: 1, Movement.BACKWARD: -1}.get(movement, 0))

    def subscribe_camera(self, width: int, height: int, fps: float) -> Feed:
        return self._walker.subscribe_camera(width, height, fps)


class SimulatedWalker(WebRobot):
    """One walker of a world. `robot` is set once it has entered, `server` once it serves.

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

    def create_app(self) -> Application:
        if self.robot is None:
            raise RuntimeError("the walker has not entered a world yet")
        return create_app(self.robot)


class Simulation(OneRobotSimulation):
    """A world with one walker; the options are those of `SimulatedWalker`."""

    KIND, SCENE = "walker", DEFAULT_SCENE
