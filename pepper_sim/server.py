"""NaoqiServer: a simulated NAOqi on a TCP port, speaking qi through the real library.

One process is the service directory and holds every AL service, as `naoqi-bin` does. Methods run concurrently; long
ones answer with a future, so that no call waits for another. There is no authentication, as on NAOqi 2.5: whoever
reaches the port can drive the robot.
"""

from __future__ import annotations

import logging
import re

import pepper_sim.naoqi  # isort: skip  # noqa: F401 -- sets libqi's environment before qi is loaded
import qi

from pepper_sim.naoqi.catalogue import Catalogue
from pepper_sim.naoqi.publish import qi_object, raw_methods
from pepper_sim.naoqi.raw_server import RawServer
from pepper_sim.robot import Pepper
from pepper_sim.tablet.tablet import Tablet

log = logging.getLogger(__name__)

DEFAULT_URL = "tcp://127.0.0.1:9559"


class CannotListen(OSError):
    """The address or port cannot be used; the text says which and why."""


class NaoqiServer:
    """All NAOqi services of one robot, ready when the constructor returns.

    Args:
        robot: The robot to serve.
        url: Where to listen; port 0 takes a free one, see `endpoints`.
        tablet: The tablet behind ALTabletService; without it the robot has none.
        seed: Seed of the microphones' noise.
    Raises:
        CannotListen: The port is taken or the address is not this machine's.
    """

    def __init__(self, robot: Pepper, url: str = DEFAULT_URL, tablet: Tablet | None = None, seed: int = 0) -> None:
        self._session = qi.Session()
        # As on the robot, the port answers 0.2 s before all services are there: libqi's directory listens as soon as it
        # exists. Opening a second port afterwards would not help: the directory keeps handing out the first one as the
        # address of every service, and a relay or another machine cannot reach that one.
        try:
            self._session.listenStandalone(url)
        except RuntimeError as error:
            raise CannotListen(f"cannot listen on {url}: {_reason(str(error))}") from None
        machine_id = self._session.service("ServiceDirectory").machineId()
        self.catalogue = Catalogue(robot, self._session, tablet, seed=seed)
        on_raw_server = [service for service in self.catalogue.services if service.raw_in_lists]
        on_qi = [service for service in self.catalogue.services if not service.raw_in_lists]
        self._raw_server = RawServer(machine_id, {service.name: raw_methods(service) for service in on_raw_server})
        self._raw_session = qi.Session()
        self._raw_session.connect(self._raw_server.url)
        for service in on_raw_server:
            self._session.registerService(service.name, self._raw_session.service(service.name))
        self._raw_server.stop_listening()
        self._objects = [(service.name, qi_object(service)) for service in on_qi]
        for name, published in self._objects:
            self._session.registerService(name, published)
        self.catalogue.clients.remember_own()

    @property
    def endpoints(self) -> list[str]:
        """The URLs that clients can connect to."""
        return list(self._session.endpoints())

    def close(self) -> None:
        """End every connection, service and thread. Calling it again does nothing."""
        if self._session is None:
            return
        self.catalogue.close()
        self._session.close()
        self._raw_session.close()
        self._raw_server.close()
        self._session = None

    def __enter__(self) -> NaoqiServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _reason(text: str) -> str:
    """Return the operating system's reason from libqi's error text, without libqi's source files."""
    found = re.search(r"(?:bind|resolve|listen)\w*: ([^\[\n]+)", text)
    reason = found.group(1).strip() if found else text
    return f"{reason}; another robot may run there (port 0 takes a free one)" if "in use" in reason else reason
