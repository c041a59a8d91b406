"""WebRTC through published ports: a container's host hands them on, and the browser knows the host alone.

An answer names this machine's own address, which only the host itself reaches, and of Docker's on macOS and Windows not
even that. So WebRTC listens on few, known ports here, and the answer names the host besides, with the same port.
"""

from __future__ import annotations

import asyncio
import os
import re
import socket

VARIABLE = "TELEPRESENCE_PAGE_UDP"
"""Environment variable: the ports, FIRST-LAST, that are published by their own numbers; without it, none."""
RESOLVE_WITHIN = 1.0
"""[s]"""
_CANDIDATE = re.compile(r"^a=candidate:(\S+) (\d+) udp (\d+) (\S+) (\d+) typ host\r?\n", re.MULTILINE)
"""RFC 8839, 5.1: foundation, component, priority, address, port."""


def published_ports() -> range:
    """Return the ports, each for one browser.

    Raises:
        ValueError: The variable is not of its form.
    """
    text = os.environ.get(VARIABLE, "")
    if not text:
        return range(0)
    first, _, last = text.partition("-")
    try:
        ports = range(int(first), int(last or first) + 1)
    except ValueError:
        raise ValueError(f"{VARIABLE}={text}: FIRST-LAST, for example 8444-8459") from None
    if not ports or ports[0] < 1 or ports[-1] > 65535:
        raise ValueError(f"{VARIABLE}={text}: two ports, the lower one first")
    return ports


async def host_address(host: str) -> str:
    """Return the IPv4 address of a machine as a request's Host header names it; empty if nobody knows one."""
    name = host.rpartition(":")[0] or host
    loop = asyncio.get_running_loop()
    try:
        found = await asyncio.wait_for(loop.getaddrinfo(name, 0, family=socket.AF_INET), RESOLVE_WITHIN)
    except (OSError, UnicodeError, TimeoutError):
        return ""
    return str(found[0][4][0])


def with_host(answer: str, host: str, ports: range) -> str:
    """Return an answer that names the host besides, after our own address, which is nearer where it is reached.

    Args:
        answer: SDP.
        host: Its address; empty for none.
        ports: Those that it hands on.
    """

    def both(line: re.Match[str]) -> str:
        foundation, component, priority, address, port = line.groups()
        if host in ("", address) or int(port) not in ports:
            return line[0]
        return line[0] + f"a=candidate:{foundation[1:]}h {component} udp {int(priority) - 1} {host} {port} typ host\r\n"

    return _CANDIDATE.sub(both, answer)
