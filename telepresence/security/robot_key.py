"""The key of a robot: who has it may drive the robot, see through its camera, and talk through it.

It is made with the robot's bundle and lies on the robot; `./stack pair ROBOT` puts it into the pilot's store,
`$XDG_CONFIG_HOME/telepresence/keys/ADDRESS.key`. It never crosses the network: both sides only prove that they have it.
Standard library only, because it runs on the robot too.
"""

from __future__ import annotations

import contextlib
import hmac
import ipaddress
import os
import re
import secrets
import socket
from pathlib import Path

from telepresence.security import private_files, signing
from telepresence.security.private_files import NotPrivate

SIZE = 32
"""Length of a key [bytes]; twice as many digits in its file."""
MOST_TEXT = 4 * SIZE
"""Length of a key's file at most [bytes]."""
_HOST = re.compile(r"[A-Za-z0-9_%:](?:[A-Za-z0-9_%:.-]{0,252}[A-Za-z0-9_%:])?")


class RobotKey:
    """32 random bytes that a robot and its pilots share.

    Args:
        secret: The bytes.
    Raises:
        ValueError: They are not 32.
    """

    def __init__(self, secret: bytes) -> None:
        if len(secret) != SIZE:
            raise ValueError(f"a robot's key has {SIZE} bytes, not {len(secret)}")
        self._secret = bytes(secret)

    def __repr__(self) -> str:
        return f"RobotKey({self.fingerprint})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RobotKey) and hmac.compare_digest(self._secret, other._secret)

    def __hash__(self) -> int:
        return hash(self.fingerprint)

    @classmethod
    def parse(cls, text: str) -> RobotKey:
        """Return the key that stands in a file, or that somebody typed: 64 hexadecimal digits, blanks between allowed.

        Raises:
            ValueError: It is none.
        """
        digits = "".join(text.split())
        if len(digits) != 2 * SIZE or not re.fullmatch(r"[0-9A-Fa-f]+", digits):
            raise ValueError(f"this is no robot's key: wanted are {2 * SIZE} hexadecimal digits")
        return cls(bytes.fromhex(digits))

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
    def read(cls, path: Path) -> RobotKey:
        """Return the key in a file that nobody but its owner can read.

        Raises:
            ValueError: It is malformed, a symbolic link, or others may read it; the text has the remedy.
            OSError: It cannot be read.
        """
        try:
            file = private_files.open_file(path, tighten=False)
        except FileNotFoundError:
            raise FileNotFoundError(f"there is no key at {path}: make_bundle.py makes one (docs/robotino.md)") from None
        except NotPrivate as error:
            raise ValueError(f"the key at {error}") from None
        except OSError as error:
            raise OSError(error.errno, f"the key at {path} cannot be read: {error.strerror}") from error
        try:
            text = os.read(file, MOST_TEXT + 1)
        finally:
            os.close(file)
        try:
            return cls.parse(text.decode("ascii"))
        except ValueError:  # UnicodeDecodeError too
            raise ValueError(f"{path} holds no robot's key: wanted are {2 * SIZE} hexadecimal digits") from None

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

    @property
    def fingerprint(self) -> str:
        """Eight digits by which people compare keys; says nothing about the key."""
        return self.mac("fingerprint").hex()[:8]

    @property
    def text(self) -> str:
        """The key itself, as 64 digits: to be shown once, to be written into its file."""
        return self._secret.hex()

    def mac(self, purpose: str, *parts: bytes) -> bytes:
        """Return the HMAC-SHA256 of the parts with this key, 32 bytes; see `telepresence.security.signing.mac`."""
        return signing.mac(self._secret, purpose, *parts)

    def matches(self, mac: bytes, purpose: str, *parts: bytes) -> bool:
        """Return whether `mac` is that of the parts, in a time that says nothing about the difference."""
        return hmac.compare_digest(mac, self.mac(purpose, *parts))

    def store(self, robot_address: str) -> Path:
        """Put the key into the pilot's store, in place of another one of this robot; its file.

        Raises:
            ValueError: It is no address.
            OSError: It cannot be written.
        """
        path = path_of(robot_address)
        private_files.make_folder(path.parent)
        private_files.write(path, self._line)
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
        raise ValueError(f"not the address of a robot: {robot_address!r}; wanted is host or host:port")
    return host.lower()


def is_loopback(host: str) -> bool:
    """Return whether nobody but this machine reaches a host: an address, or a name all of whose addresses are such.

    Raises:
        OSError: The name has no address.
    """
    addresses = {str(entry[4][0]).partition("%")[0] for entry in socket.getaddrinfo(host, None)}
    return all(ipaddress.ip_address(address).is_loopback for address in addresses)
