"""The simulation guide's session, typed letter by letter: the simulator in one terminal, the window in another with a
gamepad in the hand, and a third in which to look."""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from guide_lines import GuideLine, tables, typed, wait_for

from telepresence.station.ros_master import master_answers
from telepresence.station.virtual_display import VirtualDisplay
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT, FULL

pytestmark = [pytest.mark.ros, pytest.mark.x11]

PASSWORD = "correct horse"
RESTART, HAT_Y = 0, 7
"""Numbers of an Xbox pad's button and axis."""
STILL = 0.005
"""A walker that stands moves less than this [m] from one of its truths to the next."""
AT_ONCE = 3
"""Lines that are typed side by side: each waits for its own program to begin."""


class Hand:
    """A gamepad: a pipe in place of /dev/input/js0, because the kernel's events are plain bytes."""

    def __init__(self, path: Path) -> None:
        self.path = path
        os.mkfifo(path)
        self._file = os.open(path, os.O_RDWR | os.O_NONBLOCK)
        self.button(RESTART, False)  # the kernel begins with how everything stands

    def button(self, number: int, pressed: bool) -> None:
        os.write(self._file, EVENT.pack(0, int(pressed), BUTTON, number))

    def cross(self, where: int) -> None:
        """The cross of keys: 1 up, 0 released, -1 down; up is negative in the kernel's events."""
        os.write(self._file, EVENT.pack(0, -FULL * where, AXIS, HAT_Y))

    def close(self) -> None:
        os.close(self._file)


@pytest.fixture
def hand(tmp_path) -> Iterator[Hand]:
    made = Hand(tmp_path / "js0")
    yield made
    made.close()


@pytest.fixture
def desk(graph, tmp_path) -> Iterator[dict[str, str]]:
    """The environment of a terminal on a screen, where anna may sign in; nothing runs, the ROS master neither."""
    graph.master.end()
    display = VirtualDisplay()
    environment = {**graph.environment, **display.environment, "TELEPRESENCE_USERS": str(tmp_path / "users.db")}
    account = ["python", "-m", "gui.users", "add", "anna", "--role", "pilot", "--password-stdin"]
    subprocess.run(account, env=environment, input=PASSWORD, text=True, check=True, capture_output=True)
    yield environment
    display.close()


def xdotool(environment: dict[str, str], *words: object) -> str:
    argv = ["xdotool", *map(str, words)]
    return subprocess.run(argv, env=environment, capture_output=True, text=True, timeout=20.0).stdout


def test_simulator_and_window_in_two_terminals_and_a_gamepad(graph, desk, hand, wait_until):
    simulator, window, *others = tables()["The simulation guide: two terminals, and a third to look"]
    without_screen = {name: value for name, value in graph.environment.items() if name != "DISPLAY"}

    def type_it(line: GuideLine) -> None:
        with typed(line, without_screen):
            pass

    with (
        typed(simulator, without_screen, "--port 0") as first,
        typed(window, desk, f"--gamepad {hand.path}") as second,
    ):
        found = wait_until(lambda: xdotool(desk, "search", "--onlyvisible", "--name", "^Telepresence"), "the window")
        xdotool(desk, "windowfocus", "--sync", found.split()[0])
        for words in (("key", "ctrl+a"), ("type", "anna"), ("key", "Return"), ("type", PASSWORD), ("key", "Return")):
            xdotool(desk, *words)
        wait_for(second, "first picture")
        probe = graph.probe()
        probe.watch("/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
        start = probe.latest("/truth")

        hand.cross(1)
        wait_until(lambda: math.dist(probe.latest("/truth"), start) > 0.05, "up on the cross walks")
        x, y = probe.latest("/truth")
        assert x - start[0] > 0.04 and abs(y - start[1]) < 0.03, "forward"
        with ThreadPoolExecutor(AT_ONCE) as hands:
            list(hands.map(type_it, others))
        farthest = probe.latest("/truth")
        hand.cross(-1)
        wait_until(lambda: math.dist(probe.latest("/truth"), farthest) > 0.05, "down walks back")
        hand.cross(0)
        wait_until(lambda: math.dist(probe.latest("/truth"), probe.latest("/truth")) < STILL, "released, it stops")

        hand.button(RESTART, True)
        wait_for(second, "Button 0 pressed")
        wait_until(lambda: math.dist(probe.latest("/truth"), start) < 0.01, "button 0 puts it back to the start")
    assert "Traceback" not in first.seen + second.seen
    assert not master_answers(graph.uri)
