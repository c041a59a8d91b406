"""Which addresses are this machine's. Standard library only."""

from __future__ import annotations

import contextlib
import socket


def is_ours(host: str) -> bool:
    """Whether a host name or address leads to this machine: Linux gives a socket no address of others."""
    try:
        found = socket.getaddrinfo(host, 0, type=socket.SOCK_DGRAM)
    except OSError:
        return False
    for family, kind, _, _, place in found:
        with contextlib.suppress(OSError), socket.socket(family, kind) as probe:  # perhaps there is no IPv6
            probe.bind(place)
            return True
    return False
