"""The key of a robot: who has it may drive the robot, see through its camera, and talk through it.

It is made with the robot's bundle and lies on the robot; `./stack pair ROBOT` puts it into the pilot's store,
`$XDG_CONFIG_HOME/telepresence/keys/ADDRESS.key`. No program sends it: both sides only prove that they have it.
Standard library only, because it runs on the robot too.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
from pathlib import Path

from telepresence.security import private_files
from telepresence.security.shared_key import MOST_TEXT, SIZE, SharedKey, is_loopback

__all__ = ["MOST_TEXT", "SIZE", "RobotKey", "is_loopback"]
_HOST = re.compile(r"[A-Za-z0-9_%:](?:[A-Za-z0-9_%:.-]{0,252}[A-Za-z0-9_%:])?")


class RobotKey(SharedKey):
    """A robot's key in the hands of pilots and of who installs the robot."""

    @classmethod
    def make(cls, path: Path) -> RobotKey:
        """Make a new key and write it to a new file, readable for its owner only.

        Raises:
            FileExistsError: There is a file already; it is not changed.
            OSError: It cannot be written.
        """
        key = cls(secrets.token_bytes(SIZE))
        if not path.parent.exists():
            private_files.make_folder(path.parent)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        with open(file, "wb") as opened:
            opened.write(key._line)
        return key

    @classmethod
    def of(cls, robot_address: str) -> RobotKey | None:
        """Return the key in the pilot's store for a robot; None if there is none.

        Args:
            robot_address: Host, host:port, or http://host:port.
        Raises:
            ValueError, OSError: It is no address, or the key cannot be used; see `read`.
        """
        try:
            return cls.read(path_of(robot_address))
        except FileNotFoundError:
            return None

    def store(self, robot_address: str) -> Path:
        """Put the key into the pilot's store, in place of another one of this robot; its file.

        Raises:
            ValueError: It is no address.
            OSError: It cannot be written.
        """
        path = path_of(robot_address)
        private_files.make_folder(path.parent)
        private_files.write(path, self._line, lasting=True)
        return path

    @property
    def _line(self) -> bytes:
        """What stands in its file."""
        return f"{self.text}\n".encode("ascii")


def store_folder() -> Path:
    """Return the folder of the pilot's store."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "telepresence" / "keys"


def path_of(robot_address: str) -> Path:
    """Return the file in the pilot's store for a robot, whether or not it exists. Arguments and errors as for `of`."""
    return store_folder() / f"{host_of(robot_address)}.key"


def paired() -> dict[str, Path]:
    """Return the robots in the pilot's store: address and file of the key, by address."""
    with contextlib.suppress(FileNotFoundError):
        return {path.stem: path for path in sorted(store_folder().glob("[!.]*.key"))}
    return {}


def host_of(robot_address: str) -> str:
    """Return the host in `host`, `host:port`, `[host]:port` or `http://host:port`, in lower case.

    Raises:
        ValueError: It is no address.
    """
    text = robot_address.strip().removeprefix("http://").removesuffix("/")
    bracketed = re.fullmatch(r"\[([^]]*)\](?::\d{1,5})?", text)
    host = bracketed[1] if bracketed else text.partition(":")[0] if text.count(":") == 1 else text
    if not _HOST.fullmatch(host):
        raise ValueError(f"not the address of a robot: {robot_address!r}; expected host or host:port")
    return host.lower()
