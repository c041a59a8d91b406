"""The packages installed on the simulated robot: their behaviours and their services.

A package is a zip file with a manifest.xml (NAOqi 2.8 documentation, PackageManager):

    <package uuid="robotvideo" version="0.3.0">
      <contents><behaviorContent path="behaviour"/></contents>      the behaviour robotvideo/behaviour, whose folder
                                                                    holds Choregraphe's behavior.xar
      <services><service name="main" execStart="/usr/bin/python scripts/main.py"/></services>      robotvideo.main
"""

from __future__ import annotations

import shutil
import threading
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pepper_sim.disk import APPS, RobotDisk

BUILT_IN_BEHAVIORS = ("robotvideo/behaviour", ".lastUploadedChoregrapheBehavior/behavior_1")
"""The activity of the report's own package, and where Choregraphe puts what it uploads."""
ICON = "icon.png"
"""Where a package holds its icon, as Choregraphe puts it there."""
UNTRUSTED = (
    "somebody else than the user of this simulated robot has installed it, and its programs would run on this "
    "computer. Start the robot with --package FILE"
)
MAX_BYTES = 100_000_000
"""What a package may unpack to."""


@dataclass(frozen=True)
class ServiceProgram:
    """A program that ALServiceManager starts.

    Args:
        name: "package.service".
        command: As in the manifest, relative to `folder`.
        trusted: See `Package`.
    """

    name: str
    command: str
    folder: Path
    package: str
    trusted: bool = True


@dataclass(frozen=True)
class Behavior:
    """A behaviour of a package: "package/path", its folder or file, and what its manifest says about it."""

    name: str
    path: Path
    nature: str = ""
    tags: tuple[str, ...] = ()

    @property
    def file(self) -> Path | None:
        """The file that says what it does: Choregraphe's behavior.xar, or an animation; None if there is none."""
        candidates = (
            self.path / "behavior.xar",
            self.path.with_name(f"{self.path.name}.qianim"),
            self.path if self.path.suffix == ".qianim" else self.path / f"{self.path.name}.qianim",
        )
        return next((file for file in candidates if file.is_file()), None)


@dataclass(frozen=True)
class Package:
    """An installed package.

    Args:
        trusted: Whoever runs the simulated robot has installed it, so its programs may run: they do as this user.
    """

    uuid: str
    version: str
    folder: Path
    contents: tuple[Behavior, ...]
    services: tuple[ServiceProgram, ...]
    trusted: bool = True

    @property
    def behaviors(self) -> tuple[str, ...]:
        """The names of its behaviours."""
        return tuple(behavior.name for behavior in self.contents)


class InstalledPackages:
    """The packages on one robot's disk."""

    def __init__(self, disk: RobotDisk) -> None:
        self._disk = disk
        self._lock = threading.Lock()
        self._packages: dict[str, Package] = {}
        self._listeners: list[Callable[[], None]] = []
        self._watchers: list[Callable[[Sequence[str], Sequence[str]], None]] = []

    def icon(self, package: Package) -> bytes:
        """Return the package's icon, a PNG; nothing if it has none."""
        file = package.folder / ICON
        return file.read_bytes() if file.is_file() else b""

    @property
    def packages(self) -> list[Package]:
        """List the installed packages."""
        with self._lock:
            return list(self._packages.values())

    @property
    def behaviors(self) -> list[str]:
        """List the installed behaviours, "package/path"."""
        installed = (behavior for package in self.packages for behavior in package.behaviors)
        return list(dict.fromkeys((*BUILT_IN_BEHAVIORS, *installed)))

    def file_of(self, behavior: str) -> Path | None:
        """Return the file that says what a behaviour does; None if there is none."""
        found = self._behavior(behavior)
        return found.file if found else None

    def nature(self, behavior: str) -> str:
        """Return the nature that a behaviour's manifest names; "" for none."""
        found = self._behavior(behavior)
        return found.nature if found else ""

    def tags(self, behavior: str) -> tuple[str, ...]:
        """Return the tags that a behaviour's manifest names."""
        found = self._behavior(behavior)
        return found.tags if found else ()

    def service(self, name: str) -> ServiceProgram | None:
        """Return the program of a service, "package.service" or, as the robot allows, "service" alone."""
        services = [service for package in self.packages for service in package.services]
        return next((service for service in services if name in (service.name, service.name.partition(".")[2])), None)

    def on_removed(self, listener: Callable[[], None]) -> None:
        """Call `listener` whenever a package was removed or replaced."""
        self._listeners.append(listener)

    def on_changed(self, watcher: Callable[[Sequence[str], Sequence[str]], None]) -> None:
        """Call `watcher` with a package's behaviours before and after it was installed, replaced or removed."""
        self._watchers.append(watcher)

    def may_run(self, behavior: str) -> bool:
        """Whether the scripts of a behaviour may run; see `Package`."""
        return all(package.trusted for package in self.packages if behavior in package.behaviors)

    def install(self, file: Path, trusted: bool = True) -> Package:
        """Install a package, replacing an older one of the same name.

        Args:
            trusted: See `Package`.
        Raises:
            ValueError: It is no such package; the text says why.
        """
        try:
            with zipfile.ZipFile(file) as archive:
                _check(archive)
                root = ElementTree.fromstring(archive.read("manifest.xml"))
                uuid = root.get("uuid", "")
                if not uuid or PurePosixPath(uuid).name != uuid:
                    raise ValueError(f"its manifest.xml has the uuid {uuid!r}")
                folder = self._disk.path(f"{APPS}/{uuid}")
                shutil.rmtree(folder, ignore_errors=True)
                archive.extractall(folder)
        except (OSError, KeyError, zipfile.BadZipFile, ElementTree.ParseError) as error:
            raise ValueError(f"{file.name} is no package: {error}") from None
        package = _read(root, uuid, folder, trusted)
        with self._lock:
            replaced = self._packages.pop(uuid, None)
            self._packages[uuid] = package
        if replaced is not None:
            self._report_removal()
        self._report_change(replaced, package)
        return package

    def remove(self, uuid: str) -> None:
        """Remove a package.

        Raises:
            KeyError: There is none of this name.
        """
        with self._lock:
            package = self._packages.pop(uuid)
        self._report_removal()
        self._report_change(package, None)
        shutil.rmtree(package.folder, ignore_errors=True)

    def _behavior(self, name: str) -> Behavior | None:
        return next((found for package in self.packages for found in package.contents if found.name == name), None)

    def _report_change(self, before: Package | None, after: Package | None) -> None:
        for watcher in self._watchers:
            watcher(before.behaviors if before else (), after.behaviors if after else ())

    def _report_removal(self) -> None:
        for listener in self._listeners:
            listener()


def _check(archive: zipfile.ZipFile) -> None:
    files = archive.infolist()
    if sum(file.file_size for file in files) > MAX_BYTES:
        raise ValueError("it unpacks to more than the robot takes")
    for file in files:
        path = PurePosixPath(file.filename)
        if path.is_absolute() or ".." in path.parts:
            raise ValueError(f"it holds a file {file.filename!r} outside its folder")


def _read(root: ElementTree.Element, uuid: str, folder: Path, trusted: bool) -> Package:
    contents = tuple(_behavior(content, uuid, folder) for content in root.iterfind("contents/behaviorContent"))
    services = tuple(
        ServiceProgram(f"{uuid}.{service.get('name')}", service.get("execStart", ""), folder, uuid, trusted)
        for service in root.iterfind("services/service")
    )
    return Package(uuid, root.get("version", ""), folder, contents, services, trusted)


def _behavior(content: ElementTree.Element, uuid: str, folder: Path) -> Behavior:
    path = content.get("path", "")
    inside = PurePosixPath(path)
    if inside.is_absolute() or ".." in inside.parts:
        raise ValueError(f"its behaviour {path!r} lies outside its folder")
    tags = tuple(tag.text.strip() for tag in content.iterfind("tags/tag") if tag.text and tag.text.strip())
    return Behavior(f"{uuid}/{path}", folder / inside, content.findtext("nature", "").strip(), tags)
