"""ALStore: updates of applications. Source: NAOqi 2.8 documentation, ALStore (deprecated since 2.4)."""

from __future__ import annotations

from pepper_sim.naoqi.installed_packages import InstalledPackages
from pepper_sim.naoqi.service import Module, remote
from pepper_sim.services.al_memory import ALMemory

_NOT_ONLINE = 0
"""Status of a package that the store does not know."""


class ALStore(Module):
    """The store has closed: there is never anything newer, so every update is complete at once."""

    name = "ALStore"

    def __init__(self, packages: InstalledPackages, memory: ALMemory) -> None:
        self._packages = packages
        self._memory = memory
        memory.declare(("ALStore/Updated", "ALStore/SystemImageDownloaded"), self.name)

    @remote("v()")
    def update(self) -> None:
        """Updates the applications; ALStore/Updated tells that this is done."""
        self._memory.announce("ALStore/Updated", None)

    @remote("v()")
    def stopUpdate(self) -> None:
        """Stops an update; none takes time."""

    @remote("[m]()")
    def status(self) -> list[list[list]]:
        """Describes the installed applications: [[key, value], ...] of each."""
        return [
            [
                ["uuid", package.uuid],
                ["version", package.version],
                ["onlineVersion", ""],
                ["status", _NOT_ONLINE],
                ["percent", -1],
                ["size", 0],
            ]
            for package in self._packages.packages
        ]
