"""WebRobot: a simulated robot whose wire is a web server."""

from __future__ import annotations

from abc import abstractmethod

from telepresence.sim.simulated_robot import SimulatedRobot
from telepresence.web.json_app import Application
from telepresence.web.server import WebServer


class WebRobot(SimulatedRobot):
    """What kinds with HTTP in front of them share; a subclass provides the application."""

    server: WebServer | None = None

    @abstractmethod
    def create_app(self) -> Application:
        """The WSGI application in front of the robot, which has entered its world."""

    def serve(self, address: str, port: int) -> None:
        self.server = WebServer(self.create_app(), address, port)
        self.server.start()

    @property
    def urls(self) -> list[str]:
        return [self.server.url.rstrip("/")] if self.server else []

    def close(self) -> None:
        if self.server is not None:
            self.server.close()
