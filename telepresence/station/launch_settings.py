"""What a person may set with name:=value after `./stack up ROBOT`, and what is wrong with it before anything starts."""

from __future__ import annotations

import os
import re
import socket
import xml.etree.ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from telepresence import ports
from telepresence.switch import is_on

LAUNCH = Path(__file__).resolve().parents[2] / "launch"
SCENES = Path(__file__).resolve().parents[1] / "sim" / "scenes"


@dataclass(frozen=True)
class Simulator:
    """How a robot is reached: launch arguments for address and port, the scheme, the usual ports."""

    name: str
    address: str
    port: str
    scheme: str
    simulated_port: int
    real_port: int


PEPPER = Simulator("pepper", "nao_ip", "nao_port", "tcp", 9559, 9559)
ROBOTINO = Simulator("robotino", "robotino_ip", "robotino_port", "http", 8080, 80)
STATIONS: dict[str, tuple[Simulator, ...]] = {"pepper": (PEPPER,), "robotino": (ROBOTINO,), "both": (PEPPER, ROBOTINO)}
"""Launch file -> the robots in it that have an address. The other launch files choose their ports themselves."""
WALKER = "walker"
"""The launch file whose robot has a web server and a gait."""
OWN_SETTINGS = {
    "screen_port": f"port of the page that shows the window where there is no display; default {ports.SCREEN_PAGE}",
    "firewall": "mine, if firewall rules of your own keep others from ROS when other machines reach it",
}
"""Settings that are ours and not the launch file's, and what they are for."""


def launch_arguments(robot: str) -> set[str]:
    """Return the names of the arguments that a person can give to the launch file."""
    return arguments_of(LAUNCH / f"{robot}.launch")


def described_arguments(robot: str) -> dict[str, str]:
    """Return what each argument that a person can give to the launch file is for, with its default."""
    described = {}
    for argument in _arguments(robot):
        purpose, default = " ".join(argument.get("doc", "").split()), _in_words(argument.get("default", ""))
        described[argument.get("name", "")] = f"{purpose}; default {default}" if default else purpose
    return described


def _in_words(default: str) -> str:
    """A default as it stands in a launch file, without roslaunch's substitutions (wiki.ros.org/roslaunch/XML)."""
    default = re.sub(r"\$\((?:arg|eval) (.*)\)", r"\1", default)
    return re.sub(r"\$\(optenv (\S+) (\S+)\)", r"\2, or what \1 says", default)


def arguments_of(launch_file: Path) -> set[str]:
    """Return the names of the arguments that a person can give to any launch file."""
    return {argument.get("name", "") for argument in _declared(launch_file)}


def _arguments(robot: str) -> list[xml.etree.ElementTree.Element]:
    return _declared(LAUNCH / f"{robot}.launch")


def _declared(launch_file: Path) -> list[xml.etree.ElementTree.Element]:
    root = xml.etree.ElementTree.parse(launch_file).getroot()
    return [argument for argument in root.iterfind("arg") if argument.get("value") is None]


def require_known(robot: str, settings: dict[str, str]) -> None:
    """Raise RuntimeError when the launch file has no such argument, which roslaunch itself ignores, or its value names
    nothing that there is."""
    known = sorted({*launch_arguments(robot), *OWN_SETTINGS})
    for name in settings:
        if name not in known:
            raise RuntimeError(f"{robot} has no argument '{name}'; arguments: {', '.join(known)}")
    require_choices(robot, settings)


def require_choices(robot: str, settings: dict[str, str]) -> None:
    """Raise RuntimeError when there is no such scene or gait: with it the simulator would end at once."""
    scenes = sorted(path.stem for path in SCENES.glob("*.xml"))
    for name in ("scene", "terrain"):
        if settings.get(name, scenes[0]) not in scenes:
            raise RuntimeError(f"there is no {name} '{settings[name]}'; there are: {', '.join(scenes)}")
    if robot == WALKER and "gait" in settings:
        from telepresence.sim.walker.gait import GAITS  # NumPy, which nobody else here needs

        if settings["gait"] not in GAITS:
            raise RuntimeError(f"there is no gait '{settings['gait']}'; there are: {', '.join(GAITS)}")


def require_loopback(settings: dict[str, str], name: str) -> None:
    """Raise RuntimeError when the drivers would drive a real robot while a simulated one starts too."""
    address = settings.get(name, "127.0.0.1")
    if address not in ("127.0.0.1", "localhost"):
        raise RuntimeError(f"{name}:={address} is no simulated robot: add sim:=false for a real one")


class DrivePort(NamedTuple):
    """Where a drive server that a station starts here listens: the launch argument with its udp port, the usual one,
    whose it is."""

    argument: str
    port: int
    purpose: str


def drive_ports(robot: str, settings: dict[str, str], simulated: bool) -> list[DrivePort]:
    """Return where the drive servers of a station listen. Where another station's has the port, this one's would not
    start, and its driver would drive the other one's robot."""
    wires, both = STATIONS.get(robot, ()), robot == "both"
    found = []
    elsewhere = settings.get("pepper_drive_server" if both else "drive_server", "")
    if PEPPER in wires and not elsewhere and is_on(settings, "watchdog"):
        usual = int(os.environ.get("DRIVE_PORT", ports.PEPPER_DRIVE))
        found.append(DrivePort("pepper_drive_port" if both else "drive_port", usual, "Pepper's drive server"))
    if ROBOTINO in wires and simulated:
        found.append(DrivePort("drive_port", ports.ROBOTINO_DRIVE, "Robotino's drive server"))
    return found


def require_free(port: int, argument: str, purpose: str, udp: bool = False, address: str = "127.0.0.1") -> None:
    """Raise RuntimeError, from the system's error, when the port of this address of this machine cannot be had."""
    with socket.socket(type=socket.SOCK_DGRAM if udp else socket.SOCK_STREAM) as probe:
        if not udp:  # of tcp, connections that have ended may linger there
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except PermissionError as error:
            raise RuntimeError(
                f"{'udp ' if udp else ''}port {port}, wanted for {purpose}, is not for everybody: {allow_port(port)}, "
                f"or choose another one with {argument}:=<port>"
            ) from error
        except OSError as error:
            raise RuntimeError(
                f"{'udp ' if udp else ''}port {port}, wanted for {purpose}, is taken: another ./stack up may be "
                f"running. Choose another one with {argument}:=<port>"
            ) from error


def allow_port(port: int) -> str:
    """Return how an administrator lets every user have this port and those above: ip(7), which keeps those below 1024
    for root."""
    return f"allow it by  sudo sysctl net.ipv4.ip_unprivileged_port_start={port}"


def port_setting(settings: dict[str, str], name: str, default: int) -> int:
    """Return the port that the person chose. Raise RuntimeError when it is none."""
    text = settings.get(name, str(default))
    if not (text.isascii() and text.isdigit() and 0 < int(text) < 65536):
        raise RuntimeError(f"{name}:={text} is not a port: a number from 1 to 65535 is needed")
    return int(text)


def require_ports(robot: str, settings: dict[str, str], simulated: bool) -> None:
    """Raise RuntimeError when a port that the station will listen on is in use, or a robot's address is no simulated
    one's."""
    wires = STATIONS.get(robot, ())
    if simulated:
        for wire in wires:
            require_loopback(settings, wire.address)
            port = port_setting(settings, wire.port, wire.simulated_port)
            require_free(port, wire.port, f"the simulated {wire.name}")
    if PEPPER in wires and simulated:
        robot_page = port_setting(settings, "robot_page_port", ports.OWNER_PAGE)
        require_free(robot_page, "robot_page_port", "the simulated Pepper's own page")
    if PEPPER in wires:
        require_free(port_setting(settings, "page_port", ports.TABLET_PAGE), "page_port", "the tablet's page")
    if robot == WALKER and settings.get("port") != "0":  # which takes a free one
        require_free(port_setting(settings, "port", ports.WALKER), "port", "the walker's web server")
    for drive in drive_ports(robot, settings, simulated):
        require_free(port_setting(settings, drive.argument, drive.port), drive.argument, drive.purpose, udp=True)
