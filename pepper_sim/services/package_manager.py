"""PackageManager: the packages on the robot. Source: NAOqi 2.8 documentation, PackageManager."""

from __future__ import annotations

import hashlib
import ipaddress
from typing import Any

from pepper_sim.disk import APPS, RobotDisk
from pepper_sim.naoqi.installed_packages import InstalledPackages, Package
from pepper_sim.naoqi.service import Service, ServiceError, remote, shown
from telepresence.naoqi.connection import Connection
from telepresence.naoqi.incoming_call import caller
from telepresence.naoqi.signals import Signal
from telepresence.security import local_users


class PackageManager(Service):
    """Installs and removes packages."""

    name = "PackageManager"

    def __init__(self, packages: InstalledPackages, disk: RobotDisk) -> None:
        self._packages = packages
        self._disk = disk
        self.onPackageInstalled = Signal("(m)")
        self.onPackageRemoved = Signal("(m)")
        self.onPackageInstalled2 = Signal("(m)")
        self.onPackageRemoved2 = Signal("(m)")
        self.packageInstalled = Signal("(m)")
        self.packageRemoved = Signal("(m)")

    @remote("b(s)")
    def install(self, path: str) -> bool:
        """Installs a package from a file of the robot's disk; true, or an error that says what is wrong with it."""
        try:
            package = self._packages.install(self._disk.path(path), trusted=_is_users_own(caller()))
        except ValueError as error:
            raise ServiceError(str(error)) from None
        for signal in (self.onPackageInstalled, self.packageInstalled):
            signal(_info(package))
        self.onPackageInstalled2(_info2(package))
        return True

    @remote("b(ss)")
    def installCheckMd5(self, path: str, md5: str) -> bool:
        """Installs a package if its file has this MD5 sum [hexadecimal]; false if it has another one."""
        file = self._disk.path(path)
        if not file.is_file():
            raise ServiceError(f"there is no file {shown(path)}")
        return hashlib.md5(file.read_bytes()).hexdigest() == md5.lower() and self.install(path)

    @remote("v(s)")
    def removePkg(self, uuid: str) -> None:
        """Removes a package; an error if there is none of this name."""
        package = self._find(uuid)
        self._packages.remove(uuid)
        for signal in (self.onPackageRemoved, self.packageRemoved):
            signal(_info(package))
        self.onPackageRemoved2(_info2(package))

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

    @remote("m()")
    def packages2(self) -> list[dict[str, Any]]:
        """Lists the installed packages with all that is known of them."""
        return [_info2(package) for package in self._packages.packages]

    @remote("m(s)")
    def package2(self, uuid: str) -> dict[str, Any]:
        """Describes a package with all that is known of it; an error if there is none of this name."""
        return _info2(self._find(uuid))

    @remote("s(s)")
    def packageIcon(self, uuid: str) -> bytes:
        """Returns the PNG that is a package's icon; nothing if it has none."""
        return self._packages.icon(self._find(uuid))

    @remote("m()")
    def getPackages(self) -> list[list[list]]:
        """Old form of packages: [[key, value], ...] of each."""
        return [_pairs(package) for package in self._packages.packages]

    @remote("m(s)")
    def getPackage(self, uuid: str) -> list[list]:
        """Old form of package: [[key, value], ...]."""
        return _pairs(self._find(uuid))

    @remote("m(s)")
    def getPackageIcon(self, uuid: str) -> bytes:
        """Old form of packageIcon."""
        return self._packages.icon(self._find(uuid))

    def _find(self, uuid: str) -> Package:
        for package in self._packages.packages:
            if package.uuid == uuid:
                return package
        raise ServiceError(f"package '{shown(uuid)[1:-1]}' is not installed")


def _is_users_own(connection: Connection | None) -> bool:
    """Whether the user of this program asks, and not somebody else of this computer or from the network."""
    if connection is None or connection.ends is None:
        return True  # from within this program
    peer, own = connection.ends
    return ipaddress.ip_address(peer[0].partition("%")[0]).is_loopback and local_users.is_own(peer, own)


def _info(package: Package) -> dict[str, Any]:
    return {
        "uuid": package.uuid,
        "version": package.version,
        "behaviors": list(package.behaviors),
        "services": [service.name for service in package.services],
    }


def _info2(package: Package) -> dict[str, Any]:
    return {**_info(package), "path": f"{APPS}/{package.uuid}"}


def _pairs(package: Package) -> list[list]:
    return [[key, value] for key, value in _info(package).items()]
