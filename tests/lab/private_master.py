"""A ROS master for one test."""

import subprocess
import uuid
from collections.abc import Callable

from telepresence.station.ros_master import master_answers, master_proxy


def start_master(uri: str, run_program: Callable, wait_until: Callable) -> subprocess.Popen:
    """Start a ROS master with the one parameter of roscore that others wait for: roslaunch --wait for the run's id."""
    port = uri.rpartition(":")[2]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    master: subprocess.Popen = run_program("rosmaster", "--core", "-p", port, **quiet)
    wait_until(lambda: master_answers(uri), "the ROS master answers")
    master_proxy(uri).setParam("/roscore", "/run_id", str(uuid.uuid1()))
    return master
