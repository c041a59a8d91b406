"""Which connection leads to a service: the one that is there, or a new one to an address of its ServiceInfo.

A robot behind a port forward or NAT lists addresses that cannot be reached from here; it is recognised by endpoints
that equal the one dialled, by "qi:" endpoints, or by those of the service directory itself.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable, Sequence

from .dial import split_url

DIRECTORY = "qi:ServiceDirectory"
MAX_ADDRESSES = 16
"""Addresses of one service that are looked at."""


def normal(url: str) -> str:
    """Return an address as endpoints write it: "127.0.0.1" -> "tcp://127.0.0.1:9559". RuntimeError: it is none."""
    secure, host, port = split_url(url)
    return f"{'tcps' if secure else 'tcp'}://{host}:{port}"


def is_loopback(url: str) -> bool:
    """Whether an address leads to its own machine only."""
    host = split_url(url)[1]
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def dialable(endpoints: Iterable[str]) -> list[str]:
    """Return the endpoints that one can connect to, each once."""
    found = []
    for endpoint in endpoints:
        try:
            url = normal(endpoint)
        except RuntimeError:
            continue  # "qi:..." and whatever comes later
        if not url.endswith(":0") and url not in found:
            found.append(url)
            if len(found) == MAX_ADDRESSES:
                break
    return found


def stays(endpoints: Sequence[str], dialled: str, directory: Sequence[str]) -> bool:
    """Whether the connection to the directory leads to a service, too.

    Args:
        endpoints: Of the service.
        dialled: Address of the directory as it was dialled.
        directory: Endpoints of the directory.
    """
    addresses = dialable(endpoints)
    if not addresses or DIRECTORY in endpoints or normal(dialled) in addresses:
        return True
    return set(addresses) == set(dialable(directory))


def candidates(endpoints: Sequence[str], same_machine: bool) -> list[str]:
    """Return the addresses to try: the loopback ones on the same machine, else the others, or else all."""
    addresses = dialable(endpoints)
    fitting = [url for url in addresses if is_loopback(url) == same_machine]
    return fitting or addresses
