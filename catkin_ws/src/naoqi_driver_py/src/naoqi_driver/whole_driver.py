"""`rosrun naoqi_driver_py naoqi_driver.py --pip ADDRESS`: all nodes of the driver, as naoqi_driver.launch starts them.

The robot's address, first found wins: `--pip` and `--pport`, `--qi-url` as the driver in C++ has it, the private
parameters `_pip:=` and `_pport:=`, the environment's NAO_IP and NAO_PORT. Other private parameters are arguments of the
launch file: `_safety:=false`. roslaunch starts a ROS master when none answers.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import urlsplit

import rospkg

from naoqi_driver.connection import CONNECT_TIMEOUT, Address
from telepresence.station.launch_settings import arguments_of

LAUNCH = ["roslaunch", "naoqi_driver_py", "naoqi_driver.launch"]


def main(arguments: Sequence[str] | None = None) -> None:
    """Become roslaunch with the driver's launch file.

    Raises:
        SystemExit: The command line names no robot, or none answers there.
    """
    command, address = read_command_line(sys.argv[1:] if arguments is None else arguments)
    require_robot(address)
    os.execvp(command[0], command)


def read_command_line(arguments: Sequence[str]) -> tuple[list[str], Address]:
    """Return the command that starts the driver, and the robot's address.

    Raises:
        SystemExit: With a usage line, when the arguments are wrong or name no robot.
    """
    parser = argparse.ArgumentParser(
        prog="naoqi_driver.py", description="Drive a NAOqi robot from ROS: all nodes of the driver."
    )
    parser.add_argument("--pip", help="address of the robot: IP, host name, host:port, or URL (tcp://, tcps://)")
    parser.add_argument("--pport", type=int, help="NAOqi's port, 9559 if nothing else is said")
    parser.add_argument("--qi-url", help="another name for --pip")
    parser.add_argument("settings", nargs="*", metavar="_name:=value", help="arguments of naoqi_driver.launch")
    options = parser.parse_args(arguments)
    settings = {}
    for setting in options.settings:
        name, sign, value = setting.partition(":=")
        if not sign or not name.startswith("_"):
            parser.error(f"'{setting}' is not of the form _name:=value")
        if not name.startswith("__"):  # __name, __ns and __log are roslaunch's business
            settings[name[1:]] = value
    ip = options.pip or options.qi_url or settings.pop("pip", None) or os.environ.get("NAO_IP")
    port = options.pport or settings.pop("pport", None) or os.environ.get("NAO_PORT", "9559")
    if not ip:
        parser.error("which robot? --pip ADDRESS, or NAO_IP in the environment; the simulated one is --pip 127.0.0.1")
    try:
        address = Address.parse(ip, int(port))
    except ValueError as error:
        parser.error(str(error))
    known = arguments_of(Path(rospkg.RosPack().get_path(LAUNCH[1])) / "launch" / LAUNCH[2])
    for name in settings:
        if name not in known:  # roslaunch itself would ignore it
            parser.error(
                f"there is no argument '_{name}'; arguments: {', '.join(f'_{each}' for each in sorted(known))}"
            )
    words = {**settings, "nao_ip": ip, "nao_port": str(port)}
    return [*LAUNCH, *(f"{name}:={value}" for name, value in words.items())], address


def require_robot(address: Address) -> None:
    """Raise SystemExit when nothing listens at the robot's address."""
    place = urlsplit(address.url)
    try:
        socket.create_connection((place.hostname, place.port), timeout=CONNECT_TIMEOUT).close()
    except OSError as error:
        sys.exit(
            f"naoqi_driver.py: no robot answers at {address}: {error}. Is it on, and in this network? To wait for one "
            f"that is still starting:  {' '.join(LAUNCH)} nao_ip:={place.hostname}"
        )
