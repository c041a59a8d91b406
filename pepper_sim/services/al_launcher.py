"""ALLauncher: loads modules into NAOqi. Source: NAOqi 2.8 documentation, ALLauncher (deprecated since 1.12)."""

from __future__ import annotations

from pathlib import PurePosixPath

from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.service import Module, ServiceError, remote, shown


class ALLauncher(Module):
    """Finds the modules that are there. The simulated robot loads no compiled libraries."""

    name = "ALLauncher"

    def __init__(self, clients: ClientServices) -> None:
        self._clients = clients

    @remote("[s](s)")
    def launchLocal(self, moduleName: str) -> list[str]:
        """Loads a module by name or path and lists what was not there before: nothing, or an error if it is unknown."""
        name = PurePosixPath(moduleName).name.removeprefix("lib").removesuffix(".so")
        if name.lower() not in (known.lower() for known in self._clients.names()):
            raise ServiceError(f"cannot find the library of {shown(moduleName)}")
        return []
