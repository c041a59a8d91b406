"""A terminal with nobody in front of it, and a subscriber of cmd_vel."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import subprocess
import sys
import termios
import textwrap
import threading
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest

from telepresence.station import processes


class Terminal:
    """A program in a new terminal, as its controlling one: what a person types and sees there."""

    def __init__(self, *argv: str) -> None:
        self.master, self.slave = pty.openpty()
        self.seen = ""
        self.process = subprocess.Popen(
            argv,
            stdin=self.slave,
            stdout=self.slave,
            stderr=self.slave,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="terminal-reader", daemon=True)
        self._reader.start()

    def type(self, text: str) -> None:
        os.write(self.master, text.encode())

    def echoes(self) -> bool:
        return bool(termios.tcgetattr(self.slave)[3] & termios.ECHO)

    def takes_lines(self) -> bool:
        return bool(termios.tcgetattr(self.slave)[3] & termios.ICANON)

    def hang_up(self) -> None:
        """Close the terminal's window."""
        self._closing.set()
        self._reader.join(timeout=5.0)  # the kernel keeps the terminal open as long as anybody reads
        for descriptor in (self.slave, self.master):
            if descriptor >= 0:
                os.close(descriptor)
        self.slave = self.master = -1

    def close(self) -> None:
        self.hang_up()
        processes.end(self.process, patience=10.0)

    def _read(self) -> None:
        while not self._closing.is_set():
            if select.select([self.master], [], [], 0.05)[0]:
                self.seen += os.read(self.master, 4096).decode(errors="replace")


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
