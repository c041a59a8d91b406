"""Which sockets listen, from Linux's own tables in /proc/net (proc(5)); needs no rights for one's own processes."""

from __future__ import annotations

import contextlib
import os
import socket
from dataclasses import dataclass
from pathlib import Path

LISTENS = {"tcp": "0A", "tcp6": "0A", "udp": "07", "udp6": "07"}
"""Table -> state of a TCP socket that accepts connections, or of a UDP socket that takes packets from anybody."""


@dataclass(frozen=True, order=True)
class Listening:
    """A socket that others can send to.

    Attributes:
        protocol: tcp or udp.
        address: Of this machine; 0.0.0.0 and :: are all of them.
    """

    protocol: str
    address: str
    port: int

    @property
    def everywhere(self) -> bool:
        """Whether it listens on every address of this machine."""
        return self.address in ("0.0.0.0", "::")


def listening(pid: int | None = None) -> dict[int, Listening]:
    """Return every listening socket of a process's network namespace (default: this one's), by inode."""
    found = {}
    for table, state in LISTENS.items():
        path = Path("/proc", str(pid or "self"), "net", table)
        for line in path.read_text().splitlines()[1:] if path.exists() else ():
            words = line.split()
            if words[3] == state:
                found[int(words[9])] = Listening(table[:3], *_place(words[1]))
    return found


def inodes_of(pid: int) -> set[int]:
    """Return the inodes of a process's sockets; none of one that has ended.

    Raises:
        PermissionError: It is somebody else's, or has rights that its user lacks.
    """
    found = set()
    with contextlib.suppress(FileNotFoundError):
        for name in os.listdir(f"/proc/{pid}/fd"):
            with contextlib.suppress(FileNotFoundError):  # it is closed meanwhile
                target = os.readlink(f"/proc/{pid}/fd/{name}")
                if target.startswith("socket:["):
                    found.add(int(target[8:-1]))
    return found


def _place(text: str) -> tuple[str, int]:
    """Read "0100007F:2B67": words of the address in this machine's order of bytes, and the port."""
    address, _, port = text.partition(":")
    raw = bytes.fromhex(address)
    family = socket.AF_INET if len(raw) == 4 else socket.AF_INET6
    ordered = b"".join(raw[i : i + 4][::-1] for i in range(0, len(raw), 4))
    return socket.inet_ntop(family, ordered), int(port, 16)
