"""Whose program is at the other end of a connection within this machine."""

from __future__ import annotations

import os
import socket
import struct
from pathlib import Path
from typing import Any


def is_own(peer: tuple[Any, ...], own: tuple[Any, ...]) -> bool:
    """Whether the program that connected belongs to the user of this one, or to root.

    Args:
        peer, own: Addresses of the connection's two ends as `socket` has them: host, port, ….
    """
    return _owner(peer, own) in (0, os.geteuid())


def _owner(peer: tuple[Any, ...], own: tuple[Any, ...]) -> int | None:
    """The user whose socket is at `peer`; None if there is none on this machine."""
    table = Path("/proc/net/tcp6" if ":" in peer[0] else "/proc/net/tcp")
    ends = [_in_table(peer), _in_table(own)]
    for line in table.read_text().splitlines()[1:]:
        words = line.split()
        if words[1:3] == ends:
            return int(words[7])
    return None


def _in_table(address: tuple[Any, ...]) -> str:
    """HOST:PORT as the kernel writes it: 32-bit words in this machine's order."""
    host, port = address[:2]
    packed = socket.inet_pton(socket.AF_INET6 if ":" in host else socket.AF_INET, host.partition("%")[0])
    return "".join(f"{word:08X}" for word in struct.unpack(f"={len(packed) // 4}I", packed)) + f":{port:04X}"
