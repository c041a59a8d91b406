"""ALServiceManager: which services run: those of installed packages, and what clients have registered.

A package's service is a program: it is started as its manifest says, with this machine's own Python, ended by SIGTERM,
and by SIGKILL 15 s later. The robot's own services cannot be stopped. Source: NAOqi 2.8 documentation, ServiceManager.
"""

from __future__ import annotations

import concurrent.futures
import os
import threading
from pathlib import Path
from typing import Any

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from pepper_sim.naoqi.service_programs import ServicePrograms
from telepresence.naoqi.signals import Signal

_STOPPED_BY_REQUEST, _CRASHED = 0, 1
"""ServiceEventReason; the numbers are not documented."""


class ALServiceManager(Service):
    """Starts and stops services."""

    name = "ALServiceManager"

    def __init__(self, clients: ClientServices, packages: InstalledPackages) -> None:
        self._clients = clients
        self._packages = packages
        self._programs = ServicePrograms(packages, clients, self._ended)
        self._lock = threading.Lock()
        self._stopped: set[str] = set()
        self.serviceStarted = Signal("(si)")
        self.serviceStopped = Signal("(si)")
        self.serviceAdded = Signal("(s)")
        self.serviceRemoved = Signal("(s)")

    @remote("v(s)")
    def start(self, name: str) -> None:
        """Starts a service; an error if it is unknown."""
        if not self.startService(name):
            raise _unknown(name)

    @remote("v(s)")
    def stop(self, name: str) -> concurrent.futures.Future | None:
        """Stops a service; an error if it is unknown or the robot's own."""
        stopped = self.stopService(name)
        if stopped is False:
            raise _unknown(name)
        return stopped if isinstance(stopped, concurrent.futures.Future) else None

    @remote("v(s)")
    def restart(self, name: str) -> concurrent.futures.Future | None:
        """Stops and starts a service; an error if it is unknown."""
        restarted = self.restartService(name)
        if restarted is False:
            raise _unknown(name)
        return restarted if isinstance(restarted, concurrent.futures.Future) else None

    @remote("b(s)")
    def startService(self, name: str) -> bool:
        """Starts a service; false if it is unknown or cannot be started. Nothing happens when it runs."""
        program = self._packages.service(name)
        if program is not None:
            if not self._programs.start(program):
                return False
            self.serviceStarted(program.name, _STOPPED_BY_REQUEST)
            return True
        if not self._clients.exists(name):
            return False
        with self._lock:
            self._stopped.discard(name)
        self.serviceStarted(name, _STOPPED_BY_REQUEST)
        return True

    @remote("b(s)")
    def stopService(self, name: str) -> bool | concurrent.futures.Future:
        """Stops a package's service, and answers when its program has ended.

        A client's service is stopped by the signal serviceStopped, on which its program is expected to end. False if
        the service is unknown or the robot's own.
        """
        program = self._packages.service(name)
        if program is not None:
            return self._programs.stop(program.name)
        if not self._clients.exists(name) or self._clients.is_own(name):
            return False
        with self._lock:
            self._stopped.add(name)
        self.serviceStopped(name, _STOPPED_BY_REQUEST)
        return True

    @remote("b(s)")
    def restartService(self, name: str) -> bool | concurrent.futures.Future:
        """Stops and starts a service; false if it is unknown."""
        stopping = self.stopService(name)
        if isinstance(stopping, concurrent.futures.Future):
            return self._programs.then(stopping, lambda: self.startService(name))
        return self.startService(name)

    @remote("v()")
    def stopAllServices(self) -> None:
        """Stops the services of packages and clients."""
        packaged = [service.name for package in self._packages.packages for service in package.services]
        for name in [*packaged, *self._clients.names()]:
            self.stopService(name)

    @remote("b(s)")
    def isServiceRunning(self, name: str) -> bool:
        """Whether a package's program runs, or a service is registered and has not been stopped."""
        program = self._packages.service(name)
        if program is not None:
            return self._programs.runs(program.name)
        return self._clients.exists(name) and name not in self._stopped

    @remote("m()")
    def services(self) -> list[dict[str, Any]]:
        """Lists all services."""
        packaged = [service.name for package in self._packages.packages for service in package.services]
        return [self._info(name) for name in [*packaged, *self._clients.names()]]

    @remote("m(s)")
    def service(self, name: str) -> dict[str, Any]:
        """Describes a service."""
        if self._packages.service(name) is None and not self._clients.exists(name):
            raise _unknown(name)
        return self._info(name)

    @remote("L(s)")
    def serviceMemoryUsage(self, name: str) -> int:
        """Returns the RAM of a service's process [bytes]; that of this simulator for the robot's own services.

        A client's process is unknown, and so is that of a package's service that does not run: an error.
        """
        program = self._packages.service(name)
        if program is None and not self._clients.exists(name):
            raise _unknown(name)
        process = os.getpid() if self._clients.is_own(name) else self._programs.process(program.name if program else "")
        if process is None:
            raise ServiceError(f"the process of '{shown(name)[1:-1]}' is not known")
        resident = int(Path(f"/proc/{process}/statm").read_text().split()[1])
        return resident * os.sysconf("SC_PAGE_SIZE")

    def _info(self, name: str) -> dict[str, Any]:
        program = self._packages.service(name)
        if program is not None:
            return {
                "name": program.name,
                "execStart": program.command,
                "running": self._programs.runs(program.name),
                "autorun": False,
                "canBeDisabled": True,
                "package": program.package,
            }
        own = self._clients.is_own(name)
        return {
            "name": name,
            "execStart": "",
            "running": name not in self._stopped,
            "autorun": own,
            "canBeDisabled": not own,
            "package": "naoqi" if own else "",
        }

    def close(self) -> None:
        """End the programs of packages."""
        self._programs.close()

    def _ended(self, name: str, crashed: bool) -> None:
        self.serviceStopped(name, _CRASHED if crashed else _STOPPED_BY_REQUEST)


def _unknown(name: str) -> ServiceError:
    return ServiceError(f"service '{shown(name)[1:-1]}' is unknown")
