"""Ports that nobody else takes."""

from __future__ import annotations

import contextlib
import random
import socket
from pathlib import Path

_RANGE = Path("/proc/sys/net/ipv4/ip_local_port_range")


def free_port() -> int:
    """A loopback port, tcp and udp, that nobody uses: below those that the kernel hands out by itself, as it does to
    every ROS node and every connection, so that none of them takes it before its user does."""
    first_of_kernel = int(_RANGE.read_text().split()[0])
    while True:
        port = random.SystemRandom().randrange(first_of_kernel // 2, first_of_kernel)
        with socket.socket() as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp, contextlib.suppress(OSError):
            tcp.bind(("127.0.0.1", port))
            udp.bind(("127.0.0.1", port))
            return port
