"""Terminals, and a subscriber of cmd_vel."""

from __future__ import annotations

import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest
from telepresence_ros.pseudo_terminal import Terminal


@pytest.fixture
def open_terminal() -> Iterator[Callable[..., Terminal]]:
    opened: list[Terminal] = []

    def open_one(*argv: str) -> Terminal:
        opened.append(Terminal(*argv))
        return opened[-1]

    yield open_one
    for terminal in opened:
        terminal.close()


class Command(NamedTuple):
    """A Twist as it arrived; `at` is the monotonic time of that [s]."""

    at: float
    vx: float
    vy: float
    wz: float

    @property
    def is_zero(self) -> bool:
        return (self.vx, self.vy, self.wz) == (0.0, 0.0, 0.0)


LISTENER = textwrap.dedent("""
    import time, rospy
    from geometry_msgs.msg import Twist
    from telepresence_ros.master_watch import MasterWatch
    rospy.init_node("listener")
    def hear(twist):
        print(time.monotonic(), twist.linear.x, twist.linear.y, twist.angular.z, flush=True)
    rospy.Subscriber("cmd_vel", Twist, hear, tcp_nodelay=True)
    MasterWatch().start()
    print("ready", flush=True)
    rospy.spin()
""")


class Listener:
    """Everything received on cmd_vel, in order."""

    def __init__(self, process: subprocess.Popen) -> None:
        self.heard: list[Command] = []
        self._process = process
        assert process.stdout.readline() == "ready\n"
        threading.Thread(target=self._read, name="listener", daemon=True).start()

    def _read(self) -> None:
        for line in self._process.stdout:
            self.heard.append(Command(*map(float, line.split())))


@pytest.fixture
def listen(ros_environment: dict[str, str], run_program: Callable) -> Callable[[], Listener]:
    """Start listening; a master must run."""
    return lambda: Listener(run_program(sys.executable, "-c", LISTENER, stdout=subprocess.PIPE, text=True))


@pytest.fixture
def listener(ros_master: dict[str, str], listen: Callable[[], Listener]) -> Listener:
    return listen()
