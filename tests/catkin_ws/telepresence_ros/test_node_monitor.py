"""roslaunch's monitor: when it has lost the station that started it."""

import os
import platform
import subprocess
import sys

import pytest
from telepresence_ros.node_monitor import NodeMonitor

from telepresence.station import vitals

EXIT = {"x86_64": 60, "aarch64": 93}[platform.machine()]
"""Linux: exit(2) of one thread."""
HALF_DEAD = f"""
import ctypes, threading, time
threading.Thread(target=time.sleep, args=(60,)).start()
input()
ctypes.CDLL(None).syscall({EXIT}, 0)
"""
"""A program whose first thread ends before another one, as it may be for a moment when it is killed."""


@pytest.fixture
def station():
    process = subprocess.Popen([sys.executable, "-c", HALF_DEAD], stdin=subprocess.PIPE, text=True)
    yield process
    process.kill()
    process.communicate()


def test_a_station_of_which_only_some_threads_are_left_is_lost(station, monkeypatch, wait_until):
    monitor = NodeMonitor()
    monkeypatch.setattr(NodeMonitor, "station", station.pid)
    monkeypatch.setattr(os, "getppid", lambda: station.pid)
    assert not monitor._lost_station()
    print(file=station.stdin, flush=True)
    wait_until(lambda: vitals.state(station.pid) == "Z", "its first thread ends")
    assert station.poll() is None, "another one has not"
    assert monitor._lost_station()
    monkeypatch.setattr(os, "getppid", lambda: 1)
    assert monitor._lost_station()
