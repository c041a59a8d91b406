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
    """A client for one thread that says when the robot is lost and found, and what it refuses: at most one line a
    second."""

    def __init__(self, address: str) -> None:
        self.client = RobotinoClient(address)
        self.lost = ""
        """Why the robot does not answer at all; empty while it does, whatever it says. For other threads too."""
        self._refusals: dict[str, str] = {}
        self._log = ChangeLog(self._answers)
        self._reminder = 0.0
        self._patience = StartPatience()

    @property
    def problem(self) -> str:
        """Why the robot does not answer, or what it refuses; empty while it does what it is asked."""
        if self.lost or not self._refusals:
            return self.lost
        (_, first), *others = self._refusals.items()
        return first + (f"; nor can it be asked for {', '.join(name for name, _ in others)}" if others else "")

    @property
    def _answers(self) -> str:
        return f"Robotino at {self.client.address} answers"

    def refusal(self, name: str) -> str:
        """Why the robot refused the last question of this name; empty if it did not."""
        return self._refusals.get(name, "")

    def ask(self, question: Callable[[RobotinoClient], object], name: str = "") -> bool:
        """Do something with the client; False if the robot was not there or refused.

        Args:
            name: Of a question that may be refused while the robot answers others.
        """
        now = time.monotonic()
        try:
            question(self.client)
        except RobotinoUnreachable as error:
            self.lost = str(error)
            if self._patience.over:
                self._complain(now, f"{error}; trying again", rospy.logerr)
            return False
        except RobotinoError as error:
            self._patience.works()
            self.lost = ""
            self._refusals[name] = str(error)
            self._complain(now, self.problem, rospy.logwarn)
            return False
        self._patience.works()
        self.lost = ""
        self._refusals.pop(name, None)
        if not self._refusals:
            self._log.note(now, self._answers, rospy.loginfo)
        return True

    def _complain(self, now: float, text: str, write: Callable[[str, str], None]) -> None:
        if now >= self._reminder:
            self._log.repeat()
        if self._log.note(now, text, write):
            self._reminder = now + REMINDER_PERIOD


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
