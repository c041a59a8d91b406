"""Ports that nobody else takes."""

from __future__ import annotations

import contextlib
import functools
import itertools
import os
import random
import socket
from collections.abc import Iterator
from pathlib import Path

_RANGE = Path("/proc/sys/net/ipv4/ip_local_port_range")
WORKERS = 8
"""Of pytest-xdist; each has ports of its own, because seconds pass before a station binds what it was given."""


def free_port() -> int:
    """A loopback port, tcp and udp, that nobody uses, and that this process has not given anybody for a long time. It
    is below those that the kernel hands out by itself, as it does to every ROS node and every connection, so that none
    of them takes it before its user does."""
    while True:
        port = next(_ports())
        with socket.socket() as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp, contextlib.suppress(OSError):
            tcp.bind(("127.0.0.1", port))
            udp.bind(("127.0.0.1", port))
            return port


@functools.cache
def _ports() -> Iterator[int]:
    """This worker's ports, again and again."""
    first_of_kernel = int(_RANGE.read_text().split()[0])
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    ports = [*range(first_of_kernel // 2 + worker % WORKERS, first_of_kernel, WORKERS)]
    random.SystemRandom().shuffle(ports)
    return itertools.cycle(ports)
