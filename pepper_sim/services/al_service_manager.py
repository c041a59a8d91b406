"""ALServiceManager: which services run. The robot's own cannot be stopped."""

from __future__ import annotations

import threading
from typing import Any

import qi

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown

_STOPPED_BY_REQUEST = 0


class ALServiceManager(Service):
    """Starts and stops services."""

    name = "ALServiceManager"

    def __init__(self, clients: ClientServices) -> None:
        self._clients = clients
        self._lock = threading.Lock()
        self._stopped: set[str] = set()
        self.serviceStarted = qi.Signal("(si)")
        self.serviceStopped = qi.Signal("(si)")
        self.serviceAdded = qi.Signal("(s)")
        self.serviceRemoved = qi.Signal("(s)")

    @remote("v(s)")
    def start(self, name: str) -> None:
        """Starts a service; an error if it is unknown."""
        if not self.startService(name):
            raise _unknown(name)

    @remote("v(s)")
    def stop(self, name: str) -> None:
        """Stops a service; an error if it is unknown or the robot's own."""
        if not self.stopService(name):
            raise _unknown(name)

    @remote("v(s)")
    def restart(self, name: str) -> None:
        """Stops and starts a service; an error if it is unknown."""
        if not self.restartService(name):
            raise _unknown(name)

    @remote("b(s)")
    def startService(self, name: str) -> bool:
        """Starts a service; false if it is unknown."""
        if not self._clients.exists(name):
            return False
        with self._lock:
            self._stopped.discard(name)
        self.serviceStarted(name, _STOPPED_BY_REQUEST)
        return True

    @remote("b(s)")
    def stopService(self, name: str) -> bool:
        """Stops a client's service by the signal serviceStopped, on which its program is expected to end.

        False if the service is unknown or the robot's own.
        """
        if not self._clients.exists(name) or self._clients.is_own(name):
            return False
        with self._lock:
            self._stopped.add(name)
        self.serviceStopped(name, _STOPPED_BY_REQUEST)
        return True

    @remote("b(s)")
    def restartService(self, name: str) -> bool:
        """Stops and starts a service; false if it is unknown."""
        self.stopService(name)
        return self.startService(name)

    @remote("v()")
    def stopAllServices(self) -> None:
        """Stops the services of clients."""
        for name in self._clients.names():
            self.stopService(name)

    @remote("b(s)")
    def isServiceRunning(self, name: str) -> bool:
        """Whether a service is registered and has not been stopped."""
        return self._clients.exists(name) and name not in self._stopped

    @remote("m()")
    def services(self) -> list[dict[str, Any]]:
        """Lists all services."""
        return [self._info(name) for name in self._clients.names()]

    @remote("m(s)")
    def service(self, name: str) -> dict[str, Any]:
        """Describes a service."""
        if not self._clients.exists(name):
            raise _unknown(name)
        return self._info(name)

    @remote("i(s)")
    def serviceMemoryUsage(self, name: str) -> int:
        """Returns the memory of a service's process [kB]; not measured for one service alone."""
        raise ServiceError(f"the memory of '{shown(name)[1:-1]}' alone is not known")

    def _info(self, name: str) -> dict[str, Any]:
        own = self._clients.is_own(name)
        return {
            "name": name,
            "execStart": "",
            "running": name not in self._stopped,
            "autorun": own,
            "canBeDisabled": not own,
            "package": "naoqi" if own else "",
        }


def _unknown(name: str) -> ServiceError:
    return ServiceError(f"service '{shown(name)[1:-1]}' is unknown")
