"""main.py, the report's program beside com_cam: keeps a page on Pepper's tablet, with the robot's focus, until Ctrl-C.

    rosrun telepresence_1 main.py --qi-url 192.168.1.20          (also IP:PORT or tcp://IP:PORT)

Needs no ROS master. The page is com_cam's, with its key when com_cam runs on this machine, or the one that --url names.
Beside a com_cam that keeps its page on the same tablet it leaves page and focus to that at its end.
"""

from __future__ import annotations

import argparse
import logging
import sys
import threading
from collections.abc import Sequence
from importlib.metadata import version

import rospy
from naoqi_driver.connection import Address, Connection
from telepresence_ros.node import stop_on_signals

from telepresence import ports
from telepresence_1.network import NoRoute, local_address_towards
from telepresence_1.page_record import read_record
from telepresence_1.robot_focus import ACTIVITY
from telepresence_1.tablet_link import TabletLink

APP_ID = "com.aldebaran.activity"
"""What the report's main.py calls itself in the log."""

log = logging.getLogger(APP_ID)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program; the exit code for the process."""
    parser = argparse.ArgumentParser(
        prog="main.py", description="Keep a page on Pepper's tablet, with the robot's focus, until Ctrl-C."
    )
    parser.add_argument("--qi-url", default="tcp://127.0.0.1:9559", help="the robot; default %(default)s")
    parser.add_argument("--url", help="the page as the tablet can reach it; default: com_cam.py's on this machine")
    parser.add_argument("--activity", default=ACTIVITY, help="what to keep in focus, or none; default %(default)s")
    parser.add_argument("--version", action="version", version=f"{APP_ID} {version('telepresence')}")
    options = parser.parse_args(rospy.myargv(sys.argv)[1:] if arguments is None else arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    logging.getLogger("rospy").setLevel(logging.WARNING)  # it is no node
    try:
        robot = Address.parse(options.qi_url)
        record = read_record(robot)
        url = (
            options.url or (record and record.url) or f"http://{local_address_towards(robot.url)}:{ports.TABLET_PAGE}/"
        )
    except (ValueError, NoRoute) as error:
        print(f"main.py: {error}", file=sys.stderr)
        return 1
    if record is None and not options.url:
        log.warning("no com_cam.py of yours runs for this robot: without it there is nothing to show at %s", url)
    stop = stop_on_signals(threading.Event())
    with Connection(robot) as connection:
        link = TabletLink(connection, url, activity=options.activity).start()
        stop.wait()
        record = read_record(robot)
        link.close(leave=record is not None and record.shown and not options.url)
    log.info("Application finished.")
    return 0
