"""The walker and its window: `launch/walker.launch` by keys, by a gamepad and by the simulation guide's topics."""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import pytest

from telepresence.station.virtual_display import VirtualDisplay
from telepresence.teleop.joystick import AXIS, BUTTON, EVENT

ROOT = Path(__file__).resolve().parents[3]
CROSS_Y = 7
"""Axis of an Xbox pad's cross; up is negative in the kernel's events."""
FULL = 32767

pytestmark = [pytest.mark.ros, pytest.mark.x11]


class Station:
    """The launched walker, its window's display, a hand on the keys and one on the gamepad."""

    def __init__(self, graph, display, pad: Path, until_true) -> None:
        self.display, self._pad, self.until = display, pad, until_true
        graph.environment.update(DISPLAY=display.name, TELEPRESENCE_SETTINGS="none")
        os.mkfifo(pad)
        self._environment = graph.environment
        self.launch = graph.run(
            "roslaunch", str(ROOT / "launch" / "walker.launch"), "port:=0", "terrain:=rough", f"gamepad:={pad}"
        )
        self.probe = graph.probe()
        self.make_probe = graph.probe
        self.probe.watch("/body_state", "std_msgs/Float32MultiArray", [f"data.{i}" for i in range(6)])
        self.probe.watch("/robot_camera", "sensor_msgs/Image", ["width", "height", "encoding", "header.frame_id"])
        self.probe.watch("/movement_command", "std_msgs/Int32", ["data"])

    def plug_in(self) -> None:
        self._writer = os.open(self._pad, os.O_WRONLY)
        self.send(*((AXIS, axis, 0) for axis in range(8)), *((BUTTON, button, 0) for button in range(11)))

    def send(self, *events: tuple[int, int, int]) -> None:
        os.write(self._writer, b"".join(EVENT.pack(0, value, kind, number) for kind, number, value in events))

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
def station(graph, tmp_path_factory, until_true):
    display = VirtualDisplay()
    station = Station(graph, display, tmp_path_factory.mktemp("pad") / "js0", until_true)
    try:
        station.launch.wait_for("The window shows the first picture")
        station.plug_in()
        yield station
        station.launch.end()
    finally:
        display.close()


def test_the_walker_walks_freezes_and_starts_again_by_the_guides_topics(station, until_true):
    probe = station.probe
    start = probe.latest("/body_state")
    assert start[2] > 0.15, "it stands"
    assert probe.latest("/robot_camera") == [640, 480, "rgb8", "robot_camera"]

    probe.order("/movement_command", 1)
    until_true(lambda: station.place()[0] > start[0] + 0.1, "it walks forward")
    probe.order("/movement_command", 0)
    station.freezes()

    answered, fields = probe.call("/restart_simulation", "std_srvs/Trigger", {})
    assert answered and fields["success"] and fields["message"]
    until_true(lambda: math.dist(station.place(), start[:2]) < 0.001, "it is back at the start")


def test_the_window_shows_picture_and_body_and_w_and_s_walk(station, until_true):
    for topic in ("/robot_camera", "/body_state"):
        subscribers = station.run("rostopic", "info", topic).partition("Subscribers")[2]
        assert "/gui_ros_node" in subscribers, topic
    start = station.place()
    station.forget_commands()
    station.key("keydown", "w")
    until_true(lambda: station.place()[0] > start[0] + 0.05, "W walks forward")
    station.key("keyup", "w")
    station.freezes()
    sent = station.commands()
    assert set(sent) == {1, 0} and sent[-1] == 0 and sent.count(1) > 5, "forward while held, stop at the release"
    station.key("keydown", "s")
    until_true(lambda: 2 in station.commands(), "S walks backward")
    station.key("keyup", "s")
    station.freezes()


def test_the_red_stop_holds_against_a_program_until_it_is_let_go(station, until_true):
    station.forget_commands()
    station.key("key", "Escape")
    until_true(lambda: station.commands().count(0) > 2, "the stop is repeated")
    begin = station.place()
    station.probe.order("/movement_command", 1)
    station.forget_commands()
    until_true(lambda: station.commands().count(0) > 5, "against the program, too")
    assert math.dist(begin, station.place()) < 0.05, "a step at most"
    station.key("key", "shift+Escape")
    station.forget_commands()
    station.key("keydown", "w")
    until_true(lambda: 1 in station.commands(), "it is let go")
    station.key("keyup", "w")
    station.freezes()


def test_what_a_window_only_reports_moves_nothing(station, until_true):
    """The windows of Pepper and Robotino say here what they do; lease and gate decide about their velocities."""
    station.freezes()
    begin = station.place()
    station.forget_commands()
    window = station.make_probe()  # a node has one publisher for a topic, which reports or commands
    for _ in range(3):
        window.report("/movement_command", 1)
    until_true(lambda: station.commands() == [1, 1, 1], "everybody sees the reports")
    station.freezes()
    assert math.dist(begin, station.place()) < 0.005


def test_the_gamepads_cross_walks_button_0_restarts_and_the_terminal_says_so(station, until_true):
    station.launch.wait_for("Joystick detected: ")
    start = station.place()
    station.send((AXIS, CROSS_Y, -FULL))
    until_true(lambda: station.place()[0] > start[0] + 0.05, "up walks forward, without LB")
    station.send((AXIS, CROSS_Y, 0))
    station.freezes()
    station.send((AXIS, CROSS_Y, FULL))
    until_true(lambda: 2 in station.commands(), "down walks backward")
    station.send((AXIS, CROSS_Y, 0))
    station.freezes()
    away = station.place()
    station.send((BUTTON, 0, 1))
    station.launch.wait_for("Button 0 pressed")
    station.send((BUTTON, 0, 0))
    until_true(lambda: math.dist(away, station.place()) > 0.03, "button 0 restarts at once")
