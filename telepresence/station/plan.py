"""What `./stack up` is to bring up, whether that can be, and the environment of all its programs."""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass

from telepresence import ports, start_patience
from telepresence.station import container_image, start_conditions
from telepresence.station.announcement import PAGE_KEY, ROBOT_PAGE_KEY, pepper_links
from telepresence.station.launch_settings import (
    STATIONS,
    launch_arguments,
    port_setting,
    require_free,
    require_known,
    require_ports,
)
from telepresence.station.log_folder import LogKeeper
from telepresence.station.pilot_page import OwnPage
from telepresence.station.screen import SCREEN_KEY
from telepresence.station.takeover import MASTER_URI, Left
from telepresence.switch import is_on
from telepresence.web.page_auth import ANNOUNCED, page_key

HEAP = {"MALLOC_ARENA_MAX": "2"}
"""How each program asks for memory (mallopt(3)): with a heap for each of their dozens of threads, what one thread has
given back lies idle while another one asks for more."""
OWN_DISTUTILS = {"SETUPTOOLS_USE_DISTUTILS": "stdlib"} if sys.version_info < (3, 12) else {}
"""Debian's roslaunch asks distutils for one function. Setuptools takes its place, while there is one: 13 MB and
0.1 s for every roslaunch."""


@dataclass(frozen=True)
class Plan:
    """What is to run."""

    robot: str
    settings: dict[str, str]
    simulated: bool
    window: bool
    """There is the operator's window."""
    page: OwnPage | None
    master_uri: str
    verbose: bool
    named: list[str]
    """What was asked for, in words."""

    @property
    def stations(self) -> int:
        """Robots of this launch file that one can drive."""
        return len(STATIONS.get(self.robot, ()))


def named(arguments: argparse.Namespace) -> list[str]:
    """What was asked for, in words."""
    return [arguments.robot, *(f"{name}:={value}" for name, value in sorted(arguments.settings.items()))]


def prepare(arguments: argparse.Namespace, left: Left | None = None) -> Plan:
    """Look whether everything can be, and set the environment of all programs.

    Args:
        left: A station that goes on: what it needs is there, and its ports are taken by itself.
    Raises:
        RuntimeError: A port is taken, or something else is missing; the text says which and what to do.
    """
    robot, settings = arguments.robot, arguments.settings
    if container_image.in_image():
        container_image.make_x_sockets()
        if "page" in launch_arguments(robot):
            settings = container_image.page_settings(settings)
    simulated = is_on(settings, "sim")
    require_known(robot, settings)
    set_ros_address()
    LogKeeper().start()
    start_conditions.require_protection(settings.get("firewall"))
    if left is None:
        require_ports(robot, settings, simulated)
    page = own_page(robot, settings, simulated, new=left is None)
    master_uri = os.environ.setdefault("ROS_MASTER_URI", MASTER_URI)
    if left is None:
        start_conditions.require_master_here(master_uri)
        start_conditions.require_no_station(master_uri)
    set_environment(robot, settings, simulated)
    window = "gui" in launch_arguments(robot) and is_on(settings, "gui")
    return Plan(robot, settings, simulated, window, page, master_uri, arguments.verbose, named(arguments))


def own_page(robot: str, settings: dict[str, str], simulated: bool, new: bool = True) -> OwnPage | None:
    """Return the pilot's page of this station; None where the launch file has none.

    Args:
        new: It does not run yet.
    Raises:
        RuntimeError: What was asked for cannot be; its port is taken.
    """
    if robot not in STATIONS:
        return None
    page = OwnPage(settings, simulated)
    if new and page.address is not None and not page.socket:
        port = port_setting(settings, "pilot_page_port", ports.PILOT_PAGE)
        require_free(port, "pilot_page_port", "the pilot's page", address=page.address)
    return page


def set_ros_address() -> None:
    """Let ROS announce and use loopback, unless a person has said otherwise: without any address it announces the name
    of the host and listens everywhere."""
    if not (os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP")):
        os.environ["ROS_IP"] = "127.0.0.1"


def set_environment(robot: str, settings: dict[str, str], simulated: bool) -> None:
    """Set what all programs of the station find in their environment."""
    for name, value in (HEAP | OWN_DISTUTILS).items():
        os.environ.setdefault(name, value)
    for variable in (PAGE_KEY, SCREEN_KEY, ROBOT_PAGE_KEY):
        os.environ[variable] = page_key(variable)
    if simulated:
        os.environ.setdefault(start_patience.VARIABLE, str(start_patience.PATIENCE_WITH_SIMULATION))
    os.environ[ANNOUNCED] = " ".join(pepper_links(robot, settings, simulated))
