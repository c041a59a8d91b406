"""Who is at the ends of a drive link: the pilot's name, and the address of the drive server."""

from __future__ import annotations

import getpass
import socket

from telepresence.drive.datagram import DEFAULT_PORT
from telepresence.drive.session import LONGEST_NAME


def default_name() -> str:
    """User and computer, as what the robot knows this pilot."""
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a number without a name
        user = "somebody"
    name = "".join(letter for letter in f"{user}@{socket.gethostname()}" if letter.isprintable())
    return name[:LONGEST_NAME]


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of `host` or `host:port`.

    Raises:
        ValueError: It is neither.
    """
    host, colon, port = text.strip().rpartition(":") if text.count(":") == 1 else (text.strip(), "", "")
    if not host or any(letter.isspace() or letter == "/" for letter in host) or not _can_be_asked_for(host):
        raise ValueError(f"not the address of a drive server: {text!r}; wanted is host or host:port")
    if colon and not (port.isdigit() and 0 < int(port) < 65536):
        raise ValueError(f"{port!r} is not a port, in {text!r}")
    return host.strip("[]"), int(port) if colon else DEFAULT_PORT


def _can_be_asked_for(host: str) -> bool:
    """Whether a name server takes it: not with two dots in a row, for example, nor with parts of over 63 letters."""
    try:
        host.encode("idna")
    except UnicodeError:
        return False
    return True
