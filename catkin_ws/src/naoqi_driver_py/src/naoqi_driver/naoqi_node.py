"""What every ROS node with a link to NAOqi needs: its address, the link, a master that may come and go, an orderly end.

Address, first found wins: command line `--pip`, `--pport`; private parameters `~pip`, `~pport`; 127.0.0.1, 9559. `pip`
may be a whole URL such as tcps://10.0.0.7:9503. User and password for NAOqi 2.9 come from `~user` and `~password` or
the environment variables NAO_USER and NAO_PASSWORD; the latter are better, as everybody on the network can read
parameters.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator

import rospy
from telepresence_ros.logs import route_logs_to_ros
from telepresence_ros.master_watch import MasterWatch, wait_for_master

from naoqi_driver.connection import Address, Connection

SHUTDOWN_TIMEOUT = 2.0
"""Seconds that the loop of a node has to end."""


class NaoqiNode:
    """A ROS node with a link to one robot.

    Args:
        name: The node's name, unless the launch file gives another.
        on_connected, on_lost: See `Connection`.
        on_master_lost: Called when the ROS master does not answer any more.

    Raises:
        SystemExit: The command line or the address is wrong, or there is no ROS master.
    """

    def __init__(
        self,
        name: str,
        on_connected: Callable[[], None] | None = None,
        on_lost: Callable[[str], None] | None = None,
        on_master_lost: Callable[[], None] | None = None,
    ) -> None:
        arguments = parse_arguments(rospy.myargv(sys.argv)[1:], name)
        wait_for_master()
        rospy.init_node(name)
        route_logs_to_ros()
        self.stop = threading.Event()
        self.master = MasterWatch(rospy, on_lost=on_master_lost).start()
        self.connection = Connection(find_address(arguments), on_connected, on_lost).start()

    def run(self, loop: Callable[[], None]) -> int:
        """Run `loop` in a thread until `self.stop` is set, and return the exit code for the process.

        Ctrl-C sets `self.stop`; the loop then has two seconds to stop the robot and return, while ROS still works.
        """
        failed = threading.Event()

        def guarded() -> None:
            try:
                loop()
            except rospy.ROSInterruptException:
                pass  # the node ends
            except Exception:
                rospy.logfatal("the node fails", exc_info=True)
                failed.set()
            if not self.stop.is_set():
                rospy.signal_shutdown("the loop of the node ended")

        thread = threading.Thread(target=guarded, name=f"{rospy.get_name()}-loop", daemon=True)

        def end() -> None:
            self.stop.set()
            if threading.current_thread() is not thread:
                thread.join(SHUTDOWN_TIMEOUT)
            self.connection.close()

        rospy.on_shutdown(end)
        thread.start()
        rospy.spin()
        return 1 if failed.is_set() else 0

    def cycles(self, period: float) -> Iterator[float]:
        """The time [s, monotonic] every `period` seconds until the node ends; a late cycle delays, it is not made
        up."""
        due = time.monotonic()
        while not self.stop.wait(max(0.0, due - time.monotonic())):
            now = time.monotonic()
            yield now
            due = max(due + period, now)


def parse_arguments(argv: list[str], program: str) -> argparse.Namespace:
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


def hide_late_publications() -> None:
    """For nodes with actions: hide that actionlib publishes from a timer that outlives the topics by a moment."""
    report = threading.excepthook

    def hook(arguments: threading.ExceptHookArgs) -> None:
        if not (rospy.is_shutdown() and isinstance(arguments.exc_value, rospy.ROSException)):
            report(arguments)

    threading.excepthook = hook
