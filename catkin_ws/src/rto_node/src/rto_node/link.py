"""A link to the robot for a node's thread, and the robot's address.

The address, first found wins: command line `--hostname`, private parameter `~hostname`, 127.0.0.1. It is a host,
host:port or http://host:port.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable

import rospy

from rto_node.client import RobotinoClient, RobotinoError, RobotinoUnreachable

REMINDER_PERIOD = 30.0
"""Seconds after which a robot that still does not answer is named again."""


class Link:
    """A client for one thread that says when the robot is lost and found, once each."""

    def __init__(self, address: str) -> None:
        self.client = RobotinoClient(address)
        self.problem = ""
        """Why the robot does not answer; empty while it does."""
        self._reminder = 0.0

    def ask(self, question: Callable[[RobotinoClient], object]) -> bool:
        """Do something with the client; False if the robot was not there or refused."""
        try:
            question(self.client)
        except RobotinoUnreachable as error:
            now = time.monotonic()
            if not self.problem or now >= self._reminder:
                self._reminder = now + REMINDER_PERIOD
                rospy.logerr("%s; trying again", error)
            self.problem = str(error)
            return False
        except RobotinoError as error:
            rospy.logwarn_throttle(10.0, "%s", error)
            self.problem = str(error)
            return False
        if self.problem:
            rospy.loginfo("Robotino at %s answers", self.client.address)
            self.problem = ""
        return True


def find_address() -> str:
    """The robot's address from command line and parameters.

    Raises:
        SystemExit: It is not an address.
    """
    parser = argparse.ArgumentParser(prog=rospy.get_name())
    parser.add_argument("--hostname", help="address of the robot: host, host:port or http://host:port")
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:])
    address = str(arguments.hostname or rospy.get_param("~hostname", "127.0.0.1"))
    try:
        RobotinoClient(address)
    except ValueError as error:
        sys.exit(f"{rospy.get_name()}: {error}")
    return address
