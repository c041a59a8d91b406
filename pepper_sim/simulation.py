"""Simulation: a world with one Pepper in it, its cameras, its tablet, and NAOqi in front of it."""

from __future__ import annotations

import contextlib

from pepper_sim.models import pepper_model
from pepper_sim.robot import Pepper
from pepper_sim.server import NaoqiServer
from pepper_sim.sound import Room
from pepper_sim.tablet import Tablet
from telepresence.sim.camera import Cameras
from telepresence.sim.scene import build_world

DEFAULT_PORT = 9559


class Simulation:
    """Runs from construction until `close`.

    Args:
        scene: Name of a scene, see `telepresence.sim.scene.scene_names`.
        seed: Start of every random sequence.
        address, port: Where NAOqi listens; port 0 takes a free one, see `url`.
    Raises:
        ValueError: Unknown scene.
        CannotListen: The port is taken or the address is not this machine's.
    """

    def __init__(
        self, scene: str = "apartment", seed: int = 0, address: str = "127.0.0.1", port: int = DEFAULT_PORT
    ) -> None:
        with contextlib.ExitStack() as stack:
            self.world = build_world(scene, [pepper_model()], seed)
            stack.callback(self.world.close)
            self.cameras = Cameras(self.world)
            stack.callback(self.cameras.close)
            self.robot = Pepper(self.world, self.cameras, seed=seed)
            self.tablet = Tablet(self.robot.show_on_tablet)
            stack.callback(self.tablet.close)
            self.world.start()
            self.server = NaoqiServer(self.robot, f"tcp://{address}:{port}", self.tablet, seed)
            stack.callback(self.server.close)
            self._stack = stack.pop_all()

    @property
    def url(self) -> str:
        """Where clients connect: the first endpoint."""
        return self.server.endpoints[0]

    @property
    def room(self) -> Room:
        """What the robot hears and plays: play a sound into `room.surroundings`, listen to `room.loudspeaker.track`."""
        return self.server.catalogue.room

    def restart(self) -> None:
        """Back to the start, clients stay connected."""
        self.world.reset()

    def close(self) -> None:
        """End server, tablet, cameras and world, in this order. Calling it again does nothing."""
        self._stack.close()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
