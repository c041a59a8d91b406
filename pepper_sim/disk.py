"""The robot's disk: a folder of this machine that stands for the root of the robot's file system.

Clients name files as on the robot, "/home/nao/recordings/a.wav"; nothing outside the folder is ever touched.
"""

from __future__ import annotations

import contextlib
from pathlib import Path, PurePosixPath

from telepresence.temporary_folder import TemporaryFolder

HOME = "/home/nao"
APPS = f"{HOME}/.local/share/PackageManager/apps"
"""Where installed packages are."""


class RobotDisk:
    """A fresh, empty disk in a temporary folder, removed by `close`; or a folder that is kept, as it is.

    Args:
        folder: The folder to use and to keep; it is made if it does not exist.
    Raises:
        OSError: The folder cannot be made.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._end = contextlib.ExitStack()
        self.root = self._end.enter_context(TemporaryFolder("pepper-disk-")) if folder is None else folder.resolve()
        self.path(HOME).mkdir(parents=True, exist_ok=True)

    def path(self, name: str) -> Path:
        """Return where the robot's file `name` is on this machine; relative names start in the robot's home folder.

        Raises:
            ValueError: The name is empty, holds a zero byte, or leads out of the disk.
        """
        if not name or "\0" in name:
            raise ValueError("a file name must not be empty")
        inside = PurePosixPath(HOME, name)
        if ".." in inside.parts:
            raise ValueError(f"the file name {name!r} must not hold '..'")
        return self.root.joinpath(*inside.parts[1:])

    def output(self, name: str) -> Path:
        """Return where a service writes the file `name` that a client has named: nowhere among installed packages,
        whose programs run on this machine.

        Raises:
            ValueError: As `path`, or it lies there.
        """
        path = self.path(name)
        if path.resolve().is_relative_to(self.path(APPS).resolve()):
            raise ValueError(f"{name!r} lies among installed packages, where only PackageManager writes")
        return path

    def close(self) -> None:
        """Remove the disk and everything on it, unless it is to be kept."""
        self._end.close()
