"""What differs when `./stack up` runs in the project's container image (Containerfile): the pilot's page is published.

A container's engine forwards a published port to the container's own address, never to its loopback. So the page is at
that address, and its links name the host's: people open them outside.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from pathlib import Path

MARK = Path(__file__).resolve().parents[2] / ".image"
"""A file that is in the image alone; `./stack layer` makes it."""
PAGE_HOST = "TELEPRESENCE_PAGE_HOST"
"""Environment variable: the name or address, with a port if it is another one, by which people reach the page."""
_ELSEWHERE = ("192.0.2.1", 9)
"""An address of nobody (RFC 5737): the way there is everybody's."""
_X_SOCKETS = Path("/tmp/.X11-unix")


def in_image() -> bool:
    """Whether this is the image."""
    return MARK.exists()


def own_address() -> str:
    """Return this container's address, which published ports lead to; loopback's without a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_ELSEWHERE)  # a datagram socket sends nothing yet
        except OSError:
            return "127.0.0.1"
        return probe.getsockname()[0]


def page_settings(settings: Mapping[str, str]) -> dict[str, str]:
    """Return a station's settings with the page where it can be published, unless a person has said where."""
    return {"page": own_address(), **settings}


def page_host(address: str, port: str) -> str:
    """Return what stands in links to the page: host and port.

    Args:
        address, port: Of the page, as this machine sees it.
    """
    host = os.environ.get(PAGE_HOST) or address
    return host if ":" in host else f"{host}:{port}"


def make_x_sockets() -> None:
    """Make the folder for X servers' sockets, which are in a container's empty /tmp: an X server that is not root makes
    none."""
    _X_SOCKETS.mkdir(mode=0o700, exist_ok=True)
