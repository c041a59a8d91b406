"""Which addresses are this machine's. Standard library only.

python3 -m telepresence.station.own_addresses HOST[:PORT]       ends with 0 if that leads to this machine
"""

from __future__ import annotations

import contextlib
import socket
import sys
from urllib.parse import urlsplit


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


if __name__ == "__main__":
    sys.exit(not is_ours(urlsplit(f"//{sys.argv[1]}").hostname or ""))
