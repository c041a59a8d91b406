"""The same launch file twice on one ROS graph: its nodes have the same names, and roslaunch starts each again."""

from __future__ import annotations

import os
import subprocess
import time

import pytest

from telepresence.station import processes
from telepresence.station.ros_master import master_proxy

pytestmark = pytest.mark.ros

LAUNCH = ("roslaunch", "rto_description", "rto_publisher.launch")
NODE = "/rto_publisher"
QUIET_FOR = 3.0
"""[s]; several times what a fight takes for one round."""


def owner(launches):
    """Which of the launches has the node that the master knows; None while none answers."""
    try:
        code, _, address = master_proxy(os.environ["ROS_MASTER_URI"], 5.0).lookupNode("/test", NODE)
        pid = master_proxy(address, 2.0).getPid("/test")[2] if code == 1 else None
    except OSError:
        return None
    return next((launch for launch in launches if pid in processes.descendants(launch.pid)), None)


def test_the_newer_one_has_the_name_and_the_older_one_comes_back_after_it(ros_master, run_program, wait_until):
    older = run_program(*LAUNCH, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: owner([older]) is older, "the node runs")
    newer = run_program(*LAUNCH, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: owner([older, newer]) is newer, "the newer one has its name")
    until = time.monotonic() + QUIET_FOR
    while time.monotonic() < until:
        assert owner([older, newer]) is newer
        time.sleep(0.05)
    processes.end(newer, patience=10.0)
    wait_until(lambda: owner([older]) is older, "the older one is back")
