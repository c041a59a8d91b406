"""Tests of launch files below rostest: unittest cases that look at what a .test file has started, and drive it.

A .test file includes the launch file and has one `<test>`, because rostest launches everything anew for each; its
program is a file beside it that ends with `rostest.rosrun(PACKAGE, NAME, Class)`, where Class is a `LaunchTest`.
"""

from __future__ import annotations

import subprocess
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import rospy

from telepresence.station import processes
from telepresence_ros.probe import Probe
from telepresence_ros.pseudo_terminal import Terminal
from telepresence_ros.single_connections import connect_once

PATIENCE = 40.0
"""Seconds after which something counts as never coming; generous, because the machines are shared."""


class LaunchTest(unittest.TestCase):
    """Tests that share one launch and one node, in alphabetical order: each must begin where any other may end.

    Class attributes:
        nodes: Must be there before the first test begins.
        drive_topic: Where `probe.drive` publishes.
    """

    nodes: ClassVar[tuple[str, ...]] = ()
    drive_topic: ClassVar[str] = "/cmd_vel"
    probe: ClassVar[Probe]
    _shared: ClassVar[Probe | None] = None

    def setUp(self) -> None:
        first = LaunchTest._shared is None
        if first:
            connect_once()
            rospy.init_node("test", disable_signals=True)
            LaunchTest._shared = LaunchTest.probe = Probe(self.drive_topic)
        self.until(lambda: {*self.probe.nodes()} >= {*self.nodes}, f"all of {sorted(self.nodes)}", 90.0)
        if first:
            self.prepare()

    def prepare(self) -> None:
        """Run once, before the first test; to watch topics, for example."""

    def until(self, condition: Callable[[], Any], what: str, timeout: float = PATIENCE) -> Any:
        """Poll until `condition()` is true and return its value; fail with `what` after `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not (value := condition()):
            if time.monotonic() > deadline:
                self.fail(f"{what}: not within {timeout:.0f} s")
            time.sleep(0.05)
        return value

    def latest(self, topic: str) -> list[Any]:
        """The fields of the next message on a watched topic."""
        self.probe.forget(topic)
        return self.newest(topic)

    def newest(self, topic: str) -> list[Any]:
        """The fields of the newest message on a watched topic; of the next one, when there was none yet."""
        return self.until(lambda: self.probe.seen(topic), f"a message on {topic}")[-1][1]

    def velocities(self, topic: str) -> list[list[float]]:
        """vx, vy [m/s] and wz [rad/s] of all commands on a topic that is watched by `watch_velocities`."""
        return [fields for _, fields in self.probe.seen(topic)]

    def watch_velocities(self, topic: str) -> None:
        """Record the commands on a topic."""
        self.probe.watch(topic, "geometry_msgs/Twist", ["linear.x", "linear.y", "angular.z"])

    def expect_topics(self, wanted: dict[str, str]) -> None:
        """Wait until these topics are published with these types."""
        self.until(lambda: wanted.items() <= self.probe.topics().items(), f"all of {sorted(wanted)}")

    def start(self, *argv: str, **popen: Any) -> subprocess.Popen:
        """Start a program that is ended after the test."""
        process = processes.start(argv, **{"stdin": subprocess.DEVNULL, **popen})
        self.addCleanup(processes.end, process)
        return process

    def open_terminal(self, *argv: str) -> Terminal:
        """Start a program in a terminal that is closed after the test."""
        terminal = Terminal(*argv)
        self.addCleanup(terminal.close)
        return terminal


def environment_of(pid: int) -> dict[str, str]:
    """The environment that a process was started with."""
    words = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace").split("\0")
    return dict(word.split("=", 1) for word in words if "=" in word)
