"""The command lines that the buttons type into the terminal."""

from __future__ import annotations

import re
import shlex
import socket
from collections.abc import Collection
from typing import NamedTuple
from urllib.parse import urlparse

from telepresence import ports

KEYBOARD = "roslaunch --wait teleop_twist_keyboard teleop.launch"
"""Without --wait, roslaunch starts a ROS master of its own when the one that ran dies at that moment."""
KEYBOARD_NAME = "teleop_twist_keyboard"
"""The name of its node, unless the line gives another."""
QUIET = "conversation:=false"
"""Option of a robot's launch file: page and sound wait for Robot feed."""
OPEN_TO_ALL = "sign_in:=false"
"""Option for a robot that may be driven without signing in."""
ROSCORE_WINDOW = "roscore"
DEFAULT_MASTER_PORT = 11311

_HOST = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9-]*[A-Za-z0-9])?(?:\.[A-Za-z0-9](?:[A-Za-z0-9-]*[A-Za-z0-9])?)*")
_NUMBERS = re.compile(r"[0-9.]+")


class Address(NamedTuple):
    """A robot's host name or IPv4 address, and its port if that is not the usual one."""

    host: str
    port: int | None = None


def parse_address(text: str) -> Address:
    """Parse `host` or `host:port`.

    Raises:
        ValueError: It is neither; the message says what is wrong.
    """
    host, colon, port = text.strip().partition(":")
    if not host:
        raise ValueError("Type the robot's address first, for example 192.168.1.10 or pepper.local.")
    if not _HOST.fullmatch(host) or len(host) > 253:
        raise ValueError(f"'{host}' is neither a host name nor an address such as 192.168.1.10.")
    if _NUMBERS.fullmatch(host) and not _is_ipv4(host):
        raise ValueError(f"'{host}' is not an IP address: four numbers from 0 to 255 are needed.")
    if not colon:
        return Address(host)
    if not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise ValueError(f"'{port}' is not a port: a number from 1 to 65535 is needed after the colon.")
    return Address(host, int(port))


def keyboard(line: str, name: str, taken: Collection[str]) -> str:
    """Return the command that starts a keyboard program under a name that is free: ROS has one node of each name.

    Args:
        line: The command without a name.
        name: The name to take if it is free.
        taken: Names of the graph's nodes, absolute.
    """
    free, number = name, 1
    while f"/{free}" in taken:
        number += 1
        free = f"{name}_{number}"
    return line if free == KEYBOARD_NAME else f"{line} name:={free}"


def roscore(master_uri: str) -> str:
    """Return the command that starts the ROS master at `master_uri`."""
    port = urlparse(master_uri).port or DEFAULT_MASTER_PORT
    return "roscore" if port == DEFAULT_MASTER_PORT else f"roscore -p {port}"


def pepper_session(address: Address, own_address: str) -> str:
    """Return the command that starts Pepper's programs."""
    words = ["roslaunch", "pepper_bringup", "tele_pepper.launch"]
    words += [f"nao_ip:={address.host}", f"roscore_ip:={own_address}"]
    if address.port not in (None, ports.NAOQI):
        words.append(f"nao_port:={address.port}")
    return shlex.join(words)


def robotino_session(address: Address, _own_address: str) -> str:
    """Return the command that starts Robotino's programs."""
    port = f":{address.port}" if address.port else ""
    return shlex.join(["roslaunch", "rto_bringup", "rto.launch", f"hostname:={address.host}{port}"])


def walker_session(_address: Address, _own_address: str) -> str:
    """Return the command that starts the walker's simulation."""
    return "roslaunch sim_bringup walker_sim.launch"


def own_address_towards(host: str) -> str:
    """Return the address at which `host` reaches this machine. Resolves the name, so it can take seconds.

    Raises:
        ValueError: The name is unknown, or the host cannot be reached.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((host, ports.NAOQI))  # sends nothing; asks the routing table
        except OSError as error:
            reason = error.strerror or str(error)
            raise ValueError(
                f"{host} cannot be reached ({reason}). Is the robot in this network, and is its address right?"
            ) from error
        return probe.getsockname()[0]


def _is_ipv4(text: str) -> bool:
    try:
        socket.inet_pton(socket.AF_INET, text)
    except OSError:
        return False
    return True
