"""The walker's window, as `launch/walker.launch` opens it: keys, the red stop, and what other windows only report."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import pytest
from repeated_presses import press_until

from telepresence.station.virtual_display import VirtualDisplay

ROOT = Path(__file__).resolve().parents[3]

pytestmark = [pytest.mark.ros, pytest.mark.x11]


class Station:
    """The launched walker with its window on a display, and a hand on the keys."""

    def __init__(self, graph, display, wait_until) -> None:
        self.until = wait_until
        graph.environment.update(display.environment, TELEPRESENCE_SETTINGS="none")
        self._environment = graph.environment
        walker = str(ROOT / "launch" / "walker.launch")
        self.launch = graph.run("roslaunch", walker, "port:=0", "terrain:=rough", "gamepad:=none")
        self.probe = graph.probe()
        self.make_probe = graph.probe
        self.probe.watch("/body_state", "std_msgs/Float32MultiArray", [f"data.{i}" for i in range(6)])
        self.probe.watch("/movement_command", "std_msgs/Int32", ["data"])

    def key(self, *words: str) -> None:
        subprocess.run(["xdotool", *words], env=self._environment, check=True, timeout=20)

    def run(self, *words: str) -> str:
        return subprocess.run(
            words, env=self._environment, check=True, capture_output=True, text=True, timeout=30
        ).stdout

    def place(self) -> list[float]:
        return self.probe.latest("/body_state")[:2]

    def forget_commands(self) -> None:
        self.probe.forget("/movement_command")

    def commands(self) -> list[int]:
        """What was sent on movement_command since `forget_commands`."""
        return [fields[0] for _, fields in self.probe.seen("/movement_command")]

    def freezes(self) -> None:
        self.until(lambda: math.dist(self.place(), self.place()) < 0.002, "it freezes")


@pytest.fixture(scope="module")
def station(graph, wait_until):
    display = VirtualDisplay()
    station = Station(graph, display, wait_until)
    try:
        station.launch.wait_for("The window shows the first picture")
        yield station
        station.launch.end()
    finally:
        display.close()


def test_the_window_shows_picture_and_body_and_w_and_s_walk(station, wait_until):
    for topic in ("/robot_camera", "/body_state"):
        subscribers = station.run("rostopic", "info", topic).partition("Subscribers")[2]
        assert "/gui_ros_node" in subscribers, topic
    start = station.place()
    station.forget_commands()
    press, release = (lambda: station.key("keydown", "w")), (lambda: station.key("keyup", "w"))
    press_until(press, release, wait_until, lambda: station.place()[0] > start[0] + 0.05, "W walks forward")
    release()
    station.freezes()
    sent = station.commands()
    assert set(sent) == {1, 0} and sent[-1] == 0 and sent.count(1) > 5, "forward while held, stop at the release"
    station.key("keydown", "s")
    wait_until(lambda: 2 in station.commands(), "S walks backward")
    station.key("keyup", "s")
    station.freezes()


def test_the_red_stop_holds_against_a_program_until_it_is_let_go(station, wait_until):
    station.forget_commands()
    station.key("key", "Escape")
    wait_until(lambda: station.commands().count(0) > 2, "the stop is repeated")

    def way() -> float:
        """Metres for one order of the program."""
        station.freezes()
        begin = station.place()
        station.probe.order("/movement_command", 1)
        station.forget_commands()
        wait_until(lambda: station.commands().count(0) > 5, "against the program, too")
        return math.dist(begin, station.place())

    # A window that is held up for a moment repeats no stop.
    assert any(way() < 0.05 for _ in range(4)), "a step at most"
    station.key("key", "shift+Escape")
    station.forget_commands()
    station.key("keydown", "w")
    wait_until(lambda: 1 in station.commands(), "it is let go")
    station.key("keyup", "w")
    station.freezes()


def test_what_a_window_only_reports_moves_nothing(station, wait_until):
    """The windows of Pepper and Robotino say here what they do; lease and gate decide about their velocities."""
    station.freezes()
    begin = station.place()
    station.forget_commands()
    window = station.make_probe()  # a node has one publisher for a topic, which reports or commands
    for _ in range(3):
        window.report("/movement_command", 1)
    wait_until(lambda: station.commands() == [1, 1, 1], "everybody sees the reports")
    station.freezes()
    assert math.dist(begin, station.place()) < 0.005
