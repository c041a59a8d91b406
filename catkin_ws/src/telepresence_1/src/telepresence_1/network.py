"""Which of this machine's addresses the robot can reach."""

from __future__ import annotations

import ipaddress
import socket
import urllib.parse

from telepresence.station.container_image import in_image


class NoRoute(RuntimeError):
    """This machine knows no way to the robot; the text says what can be done."""


def host_of(robot: str) -> str:
    """The host in a robot's address: a name, an IP address, host:port or a URL such as tcp://host:9559."""
    parts = urllib.parse.urlsplit(robot if "://" in robot else f"tcp://{robot}")
    return parts.hostname or ""


def is_loopback(address: str) -> bool:
    """Whether only this machine itself can use the address."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


def local_address_towards(robot: str) -> str:
    """The address of this machine's interface on the way to `robot`; no packet is sent.

    Raises:
        NoRoute: The name is unknown, or no network leads there.
    """
    host = host_of(robot)
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, 9, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.connect(address)
            return probe.getsockname()[0]
    except OSError as error:
        raise NoRoute(f"no way leads from this machine to the robot at {robot!r}: {error.strerror or error}") from None


def choose_address(wanted: str, own: str, robot: str) -> str:
    """Where the page is served: on one address that the robot can reach.

    Args:
        wanted: What somebody asked for; "" leaves the choice.
        own: This machine as the robot sees it, if somebody said so (roscore_ip); used if it is ours and no loopback.
        robot: The robot's address.
    Raises:
        NoRoute: As `local_address_towards`.
    """
    if wanted:
        return wanted
    if own and not is_loopback(own) and _is_ours(own):
        return own
    return local_address_towards(robot)


def address_for_tablet(served: str, own: str, robot: str) -> str:
    """Return the address at which the tablet asks for a page.

    Args:
        served: Where it is served.
        own, robot: As for `choose_address`. A container has an address that no robot reaches; `own` is its host's then,
            which publishes the port.
    Raises:
        NoRoute: As `local_address_towards`.
    """
    if in_image() and own and not is_loopback(own):
        return own
    if served in ("0.0.0.0", "::"):  # no address that anybody could ask for
        return choose_address("", own, robot)
    return served


def _is_ours(address: str) -> bool:
    try:
        family, kind, protocol, _, target = socket.getaddrinfo(address, 0, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(target)
    except OSError:
        return False
    return True
