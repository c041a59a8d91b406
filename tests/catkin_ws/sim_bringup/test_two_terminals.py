"""The simulation guide's session: the simulator in one terminal, the window in another, a gamepad in the hand."""

from __future__ import annotations

import math
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from telepresence.station.ros_master import master_answers
from telepresence.station.virtual_display import VirtualDisplay
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT, FULL

pytestmark = [pytest.mark.ros, pytest.mark.x11]

ROOT = Path(__file__).resolve().parents[3]
PASSWORD = "correct horse"
LB, RESTART, HAT_Y = 4, 0, 7
"""Numbers of an Xbox pad's buttons and axes."""
STILL = 0.002
"""A robot that stands moves less than this [m] from one of its truths to the next."""


class Terminals:
    """Windows of a tmux of our own, with a shell in each."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self._base = ["tmux", "-S", str(folder / "tmux"), "-f", "/dev/null"]
        self._environment = {name: value for name, value in environment.items() if name not in ("TMUX", "TMUX_PANE")}

    def open(self, name: str) -> None:
        size = ("-x", "200", "-y", "50", "-c", str(ROOT))
        self._call("new-session", "-d", "-s", name, *size, "bash --noprofile --norc")

    def type(self, name: str, line: str) -> None:
        self._call("send-keys", "-t", name, "-l", f'{line}; echo "ended with $?"')
        self._call("send-keys", "-t", name, "Enter")

    def interrupt(self, name: str) -> None:
        self._call("send-keys", "-t", name, "C-c")

    def text(self, name: str) -> str:
        return self._call("capture-pane", "-p", "-J", "-S", "-", "-t", name)

    def close(self) -> None:
        subprocess.run([*self._base, "kill-server"], env=self._environment, timeout=10.0, check=False)

    def _call(self, *words: str) -> str:
        argv = [*self._base, *words]
        return subprocess.run(
            argv, env=self._environment, capture_output=True, text=True, check=True, timeout=10.0
        ).stdout


class Hand:
    """A gamepad: a pipe in place of /dev/input/js0, because the kernel's events are plain bytes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        os.mkfifo(path)
        self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)

    def button(self, number: int, pressed: bool) -> None:
        os.write(self._file, EVENT.pack(0, int(pressed), BUTTON, number))

    def cross(self, up: bool) -> None:
        """The cross of keys; up is negative in the kernel's events."""
        os.write(self._file, EVENT.pack(0, -FULL if up else 0, AXIS, HAT_Y))

    def close(self) -> None:
        os.close(self._file)


@pytest.fixture
def terminals(graph, tmp_path) -> Iterator[Terminals]:
    """Two, and a screen for the window; nothing else runs, the ROS master neither."""
    graph.master.end()
    display = VirtualDisplay()
    graph.environment.update(DISPLAY=display.name, TELEPRESENCE_USERS=str(tmp_path / "users.db"))
    made = Terminals(tmp_path, graph.environment)
    for name in ("simulator", "window"):
        made.open(name)
    yield made
    made.close()
    display.close()


@pytest.fixture
def hand(tmp_path) -> Iterator[Hand]:
    made = Hand(tmp_path / "js0")
    yield made
    made.close()


def xdotool(environment: dict[str, str], *words: object) -> str:
    argv = ["xdotool", *map(str, words)]
    return subprocess.run(argv, env=environment, capture_output=True, text=True, timeout=20.0).stdout


def test_simulator_and_window_in_two_terminals_and_a_gamepad(graph, terminals, hand, until_true):
    ports = {name: graph.free_port() for name in ("robotino_port", "drive_port", "camera_port")}
    robot = f"127.0.0.1:{ports['robotino_port']}"
    terminals.type(
        "simulator",
        "./stack up robotino gui:=false terrain:=flat sign_in:=true camera:=cam0 voice:=false "
        + " ".join(f"{name}:={port}" for name, port in ports.items()),
    )
    account = f"echo '{PASSWORD}' | python -m gui.users add anna --role pilot --password-stdin"
    window = f"python -m gui --profile robotino --robot {robot} --feed image_raw --gamepad {hand.path}"
    terminals.type("window", f". ./env.sh; {account}; {window}")

    found = until_true(lambda: xdotool(graph.environment, "search", "--onlyvisible", "--name", "^Telepresence"), "it")
    xdotool(graph.environment, "windowfocus", "--sync", found.split()[0])
    for words in (("key", "ctrl+a"), ("type", "anna"), ("key", "Return"), ("type", PASSWORD), ("key", "Return")):
        xdotool(graph.environment, *words)
    until_true(lambda: master_answers(graph.uri), "the simulator's terminal brings a ROS master")
    probe = graph.probe()
    probe.watch("/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
    start = probe.latest("/truth")
    until_true(lambda: "first picture" in terminals.text("window"), "whoever has signed in sees the robot's picture")
    assert {"/robot_control_node", "/gui_ros_node"} <= set(probe.nodes())

    def come() -> float:
        """How far it is from where it began [m]."""
        return math.dist(probe.latest("/truth"), start)

    def press() -> bool:
        """LB and the cross, anew: the window lets nobody drive who held LB before it was ready."""
        hand.button(LB, False)
        hand.button(LB, True)
        hand.cross(up=True)
        return any(come() > 0.01 for _ in range(20))

    hand.cross(up=True)
    assert all(come() < STILL for _ in range(4)), "nothing without LB"
    until_true(press, "the cross drives")
    until_true(lambda: come() > 0.05, "on and on, while it is held")
    x, y = probe.latest("/truth")
    assert x - start[0] > 0.04 and abs(y - start[1]) < 0.01, "forward"

    hand.cross(up=False)
    until_true(lambda: math.dist(probe.latest("/truth"), probe.latest("/truth")) < STILL, "released, it stops")
    stands = come()
    assert all(abs(come() - stands) < STILL for _ in range(4)), "and stays"

    hand.button(LB, False)
    hand.button(RESTART, True)
    until_true(lambda: come() < 0.001, "button 0, held, puts it back to the start")

    for name in ("window", "simulator"):
        terminals.interrupt(name)
        until_true(lambda name=name: re.search(r"ended with \d", terminals.text(name)), f"Ctrl-C ends the {name}")
        assert "Traceback" not in terminals.text(name)
    assert not master_answers(graph.uri)
