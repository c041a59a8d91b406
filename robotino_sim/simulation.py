"""Simulation: a world with one Robotino in it, its cameras, and REST in front of it."""

from __future__ import annotations

import contextlib

from robotino_sim.controller import REST_WATCHDOG
from robotino_sim.models import robotino_model
from robotino_sim.robot import Robotino
from robotino_sim.server import create_app
from robotino_sim.webcam import DEFAULT_SIZE, Webcam
from telepresence.mjpeg import WebServer
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import build_world

DEFAULT_PORT = 8080
DEFAULT_SCENE = "arena"


class Simulation:
    """Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address, port: Where the web server listens; port 0 takes a free one, see `url`.
        watchdog: Silence after which the motors stop [s].
        laser: Whether the robot carries a laser scanner.
        battery: "NiMH", "Pb" or "Li-Ion".
        camera_size: Of the pictures at /cam0 (width, height) [px].
        strict_camera, cors: See `robotino_sim.server.create_app`.
        start: False leaves the world standing, for programs that step it themselves.
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
        watchdog: float = REST_WATCHDOG,
        laser: bool = False,
        battery: str = "NiMH",
        camera_size: tuple[int, int] = DEFAULT_SIZE,
        strict_camera: bool = False,
        cors: bool = False,
        start: bool = True,
    ) -> None:
        with contextlib.ExitStack() as stack:
            self.world = build_world(scene, [robotino_model(laser=laser)], seed)
            stack.callback(self.world.close)
            self.cameras = Cameras(self.world)
            stack.callback(self.cameras.close)
            self.robot = Robotino(self.world, self.cameras, seed=seed, watchdog=watchdog, battery=battery)
            self.webcam = Webcam(self.robot, camera_size)
            stack.callback(self.webcam.close)
            app = create_app(self.robot, self.webcam, strict_camera=strict_camera, cors=cors)
            self.server = WebServer(app, address, port)
            stack.callback(self.server.close)
            if start:
                self.world.start()
            self.server.start()
            self._stack = stack.pop_all()

    @property
    def url(self) -> str:
        """Where clients connect, without a slash at the end."""
        return self.server.url.rstrip("/")

    @property
    def urls(self) -> list[str]:
        """All addresses to announce."""
        return [self.url]

    def restart(self) -> None:
        """Back to the start, clients stay connected."""
        self.world.reset()

    def close(self) -> None:
        """End server, camera and world, in this order. Calling it again does nothing."""
        self._stack.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
