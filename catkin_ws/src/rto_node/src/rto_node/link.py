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
from telepresence.security.change_log import ChangeLog
from telepresence.start_patience import StartPatience

REMINDER_PERIOD = 30.0
"""Seconds after which a robot that still does not answer is named again."""


class Link:
    """A client for one thread that says when the robot is lost and found: at most one line a second."""

    def __init__(self, address: str) -> None:
        self.client = RobotinoClient(address)
        self.problem = ""
        """Why the robot does not answer; empty while it does."""
        self._log = ChangeLog(self._answers)
        self._reminder = 0.0
        self._patience = StartPatience()

    @property
    def _answers(self) -> str:
        return f"Robotino at {self.client.address} answers"

    def ask(self, question: Callable[[RobotinoClient], object]) -> bool:
        """Do something with the client; False if the robot was not there or refused."""
        now = time.monotonic()
        try:
            question(self.client)
        except RobotinoError as error:
            lost = isinstance(error, RobotinoUnreachable)
            self.problem = str(error)
            if lost and not self._patience.over:
                return False
            if now >= self._reminder:
                self._log.repeat()
            if self._log.note(
                now, f"{error}; trying again" if lost else self.problem, rospy.logerr if lost else rospy.logwarn
            ):
                self._reminder = now + REMINDER_PERIOD
            return False
        self._patience.works()
        self._log.note(now, self._answers, rospy.loginfo)
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
