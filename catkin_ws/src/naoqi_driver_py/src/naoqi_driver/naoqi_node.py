"""A ROS node with a link to NAOqi: the robot's address and the connection.

Address, first found wins: command line `--pip`, `--pport`; private parameters `~pip`, `~pport`; 127.0.0.1, 9559. `pip`
may be a whole URL such as tcps://10.0.0.7:9503. User and password for NAOqi 2.9 come from `~user` and `~password` or
the environment variables NAO_USER and NAO_PASSWORD; the latter are better, as everybody on the network can read
parameters, and the drive server of a launch file has no others.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable

import rospy
from telepresence_ros.node import ROBOT_PATIENCE, Node

from naoqi_driver import call_back
from naoqi_driver.connection import Address, Connection


class NaoqiNode(Node):
    """A ROS node with a link to one robot.

    Args:
        name: The node's name, unless the launch file gives another.
        on_connected, on_lost: See `Connection`.
        on_master_lost: Called when the ROS master does not answer any more.
        listens: The node has services for the robot: it listens for it where `~qi_listen_url` says, see
            `naoqi_driver.call_back`.

    Raises:
        SystemExit: The command line or the address is wrong, or there is no ROS master.
    """

    patience = ROBOT_PATIENCE

    def __init__(
        self,
        name: str,
        on_connected: Callable[[], None] | None = None,
        on_lost: Callable[[str], None] | None = None,
        on_master_lost: Callable[[], None] | None = None,
        listens: bool = False,
    ) -> None:
        arguments = parse_arguments(rospy.myargv(sys.argv)[1:], name)
        super().__init__(name, on_master_lost)
        listen = find_listen_url() if listens else None
        self.connection = Connection(find_address(arguments), on_connected, on_lost, listen).start()
        self.at_end(self.connection.close)


def parse_arguments(argv: list[str], program: str) -> argparse.Namespace:
    """Return `pip` and `pport` of the command line, None where it does not name them."""
    parser = argparse.ArgumentParser(prog=program)
    parser.add_argument("--pip", help="address of the robot: IP, host name, host:port, or URL (tcp://, tcps://)")
    parser.add_argument("--pport", type=int, help="NAOqi's port, 9559 if nothing else is said")
    return parser.parse_args(argv)


def find_address(arguments: argparse.Namespace) -> Address:
    """The robot's address from command line, private parameters and environment."""
    ip = arguments.pip or rospy.get_param("~pip", "127.0.0.1")
    port = arguments.pport or int(rospy.get_param("~pport", 9559))
    user = rospy.get_param("~user", os.environ.get("NAO_USER"))
    password = rospy.get_param("~password", os.environ.get("NAO_PASSWORD"))
    try:
        return Address.parse(str(ip), port, user, password)
    except ValueError as error:
        sys.exit(f"{rospy.get_name()}: {error}")


def find_listen_url() -> str:
    """Where the robot may connect to this node's services, from the private parameter."""
    url = str(rospy.get_param("~qi_listen_url", call_back.AUTOMATIC))
    try:
        call_back.check_url(url)
    except ValueError as error:
        sys.exit(f"{rospy.get_name()}: {error}")
    return url
