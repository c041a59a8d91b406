"""What every node here needs: a ROS master that may come and go, loops, an orderly end, /diagnostics, a link.

The robot's address, first found wins: command line `--hostname`, private parameter `~hostname`, 127.0.0.1. It is a
host, host:port or http://host:port.
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from collections.abc import Callable, Iterator

import rospy
from telepresence_ros.logs import route_logs_to_ros
from telepresence_ros.master_watch import MasterWatch, wait_for_master

from rto_node.client import RobotinoClient, RobotinoError, RobotinoUnreachable

SHUTDOWN_TIMEOUT = 2.0
"""Seconds that a loop has to end."""
REMINDER_PERIOD = 30.0
"""Seconds after which a robot that still does not answer is named again."""


class RosNode:
    """A ROS node whose loops end in order.

    Args:
        name: Unless the launch file gives another.
        on_master_lost: Called when the ROS master does not answer any more.
    Raises:
        SystemExit: There is no ROS master.
    """

    def __init__(self, name: str, on_master_lost: Callable[[], None] | None = None) -> None:
        wait_for_master()
        rospy.init_node(name)
        route_logs_to_ros()
        self.stop = threading.Event()
        self.master = MasterWatch(rospy, on_lost=on_master_lost).start()

    def run(self, *loops: Callable[[], None]) -> int:
        """Run each loop in a thread until `self.stop` is set; the exit code for the process.

        Ctrl-C sets `self.stop`; the loops then have two seconds to end, while ROS still works.
        """
        failed = threading.Event()

        def guarded(loop: Callable[[], None]) -> None:
            try:
                loop()
            except rospy.ROSException:
                if not self.stop.is_set():
                    rospy.logfatal("the node fails", exc_info=True)
                    failed.set()
            except Exception:
                rospy.logfatal("the node fails", exc_info=True)
                failed.set()
            if not self.stop.is_set():
                rospy.signal_shutdown("a loop of the node ended")

        threads = [threading.Thread(target=guarded, args=(loop,), name=loop.__name__, daemon=True) for loop in loops]

        def end() -> None:
            self.stop.set()
            for thread in threads:
                if threading.current_thread() is not thread:
                    thread.join(SHUTDOWN_TIMEOUT)

        rospy.on_shutdown(end)
        for thread in threads:
            thread.start()
        rospy.spin()
        return 1 if failed.is_set() else 0

    def cycles(self, period: float) -> Iterator[float]:
        """The time [s, monotonic] every `period` seconds until the node ends; a late cycle is not made up for."""
        due = time.monotonic()
        while not self.stop.wait(max(0.0, due - time.monotonic())):
            now = time.monotonic()
            yield now
            due = max(due + period, now)


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
