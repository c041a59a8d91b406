"""NaoqiServer: a simulated NAOqi on a TCP port.

One process is the service directory and holds every AL service, as `naoqi-bin` does, and every service is there before
the port answers. Methods run concurrently; long ones answer with a future, so that no call waits for another. There is
no authentication, as on NAOqi 2.5: whoever reaches the port can drive the robot.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.catalogue import Catalogue
from pepper_sim.naoqi.publish import served_object
from pepper_sim.robot import Pepper
from pepper_sim.tablet.tablet import Tablet
from telepresence.naoqi.limits import Limits
from telepresence.naoqi.releases import RELEASES
from telepresence.naoqi.server import Server

DEFAULT_URL = "tcp://127.0.0.1:9559"
MAX_MESSAGE = 32 * 1024 * 1024
"""A longer message ends its connection [bytes]."""

RELEASE = replace(RELEASES["2.5"], capabilities={**RELEASES["2.5"].capabilities, "RelativeEndpointURI": True})
"""What ALSystem.systemVersion() says it is, on the wire too, but for one capability of later robots: with it the
vendor's client stays on its connection, also behind a port forward, where the listed address leads nowhere."""


class CannotListen(OSError):
    """The address or port cannot be used; the text says which and why."""


class NaoqiServer:
    """All NAOqi services of one robot, ready when the constructor returns.

    Args:
        robot: The robot to serve.
        url: Where to listen; port 0 takes a free one, see `endpoints`.
        tablet: The tablet behind ALTabletService; without it the robot has none.
        seed: Seed of the microphones' noise.
        disk: The robot's files; without it a fresh disk that ends with the server.
    Raises:
        CannotListen: The port is taken or the address is not this machine's.
    """

    def __init__(
        self,
        robot: Pepper,
        url: str = DEFAULT_URL,
        tablet: Tablet | None = None,
        seed: int = 0,
        disk: RobotDisk | None = None,
    ) -> None:
        with contextlib.ExitStack() as opened:
            self._server = Server(url, release=RELEASE, limits=Limits(payload=MAX_MESSAGE))
            opened.callback(self._server.close)
            self.catalogue = Catalogue(robot, self._server, tablet, seed, disk)
            opened.callback(self.catalogue.close)
            for service in self.catalogue.services:
                self._server.register(service.name, served_object(service))
            self.catalogue.clients.remember_own()
            try:
                self._server.start()
            except OSError as error:
                raise CannotListen(error.strerror or str(error)) from None
            self._opened = opened.pop_all()

    @property
    def endpoints(self) -> list[str]:
        """The URLs that clients can connect to."""
        return list(self._server.endpoints)

    def close(self) -> None:
        """End every connection, service and thread. Calling it again does nothing."""
        self._opened.close()

    def __enter__(self) -> NaoqiServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
