"""PackageManager: the packages on the robot. Source: NAOqi 2.8 documentation, PackageManager."""

from __future__ import annotations

from typing import Any

from pepper_sim.disk import RobotDisk
from pepper_sim.naoqi.installed_packages import InstalledPackages, Package
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from telepresence.naoqi.signals import Signal


class PackageManager(Service):
    """Installs and removes packages."""

    name = "PackageManager"

    def __init__(self, packages: InstalledPackages, disk: RobotDisk) -> None:
        self._packages = packages
        self._disk = disk
        self.onPackageInstalled = Signal("(m)")
        self.onPackageRemoved = Signal("(m)")

    @remote("b(s)")
    def install(self, path: str) -> bool:
        """Installs a package from a file of the robot's disk; true, or an error that says what is wrong with it."""
        try:
            package = self._packages.install(self._disk.path(path))
        except ValueError as error:
            raise ServiceError(str(error)) from None
        self.onPackageInstalled(_info(package))
        return True

    @remote("v(s)")
    def removePkg(self, uuid: str) -> None:
        """Removes a package; an error if there is none of this name."""
        package = self._find(uuid)
        self._packages.remove(uuid)
        self.onPackageRemoved(_info(package))

    @remote("b(s)")
    def hasPackage(self, uuid: str) -> bool:
        """Whether a package is installed."""
        return uuid in [package.uuid for package in self._packages.packages]

    @remote("m()")
    def packages(self) -> list[dict[str, Any]]:
        """Lists the installed packages."""
        return [_info(package) for package in self._packages.packages]

    @remote("m(s)")
    def package(self, uuid: str) -> dict[str, Any]:
        """Describes a package; an error if there is none of this name."""
        return _info(self._find(uuid))

    def _find(self, uuid: str) -> Package:
        for package in self._packages.packages:
            if package.uuid == uuid:
                return package
        raise ServiceError(f"package '{shown(uuid)[1:-1]}' is not installed")


def _info(package: Package) -> dict[str, Any]:
    return {
        "uuid": package.uuid,
        "version": package.version,
        "behaviors": list(package.behaviors),
        "services": [service.name for service in package.services],
    }
