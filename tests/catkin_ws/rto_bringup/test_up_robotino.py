"""`./stack up robotino` as a whole: the window shows the camera by WebRTC, W drives, release stops, and the gate that
says so runs on the robot.

One station serves all tests of this file, which run in order; the last one kills it.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
import signal
import subprocess
import sys
import urllib.request
import uuid
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import socket_table
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import processes, station_folder
from telepresence.station.ros_master import master_proxy
from telepresence.station.virtual_display import grab

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

ROOT = Path(__file__).resolve().parents[3]
HEADING = ("60", "84")
"""A place in the window that takes the keyboard and does nothing else [pixel]."""
CAREFUL = ("200", "625")
"""The switch of the careful scan [pixel]."""


class Station:
    def __init__(self, graph) -> None:
        graph.environment.pop("DISPLAY", None)
        self.environment = graph.environment
        # roslaunch waits for what roscore sets on every master, and a bare one lacks it.
        master_proxy(graph.uri, timeout=5.0).setParam("/test", "/run_id", str(uuid.uuid4()))
        names = ("robotino_port", "drive_port", "camera_port", "sound_port", "screen_port")
        self.ports = {name: graph.free_port() for name in names}
        self.program = graph.run(
            str(ROOT / "stack"),
            "up",
            "robotino",
            "page:=false",
            *(f"{name}:={port}" for name, port in self.ports.items()),
        )
        self.probe = graph.probe()
        self.probe.watch("/truth", "nav_msgs/Odometry", ["pose.pose.position.x", "pose.pose.position.y"])
        self.probe.watch(
            "/rto3/safety", "telepresence_msgs/SafetyState", ["state", "reason", "vx", "len(allowed)", "scanning"]
        )
        self.probe.watch("/rto3/careful", "std_msgs/String", ["data"])
        self.probe.watch("/rto3/camera_state", "std_msgs/String", ["data"])
        self.program.wait_for("first picture")

    @property
    def screen(self) -> Path:
        """The folder that the station's Xvfb writes its screen to."""
        for pid in processes.descendants(self.program.process.pid):
            words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
            if words[0] == "Xvfb":
                return Path(words[words.index("-fbdir") + 1])
        pytest.fail("the station has no virtual display")

    def xdotool(self, *words: str) -> None:
        display = re.search(r"virtual one \((:\d+)\)", self.program.output).group(1)
        environment = {**self.environment, "DISPLAY": display, "XAUTHORITY": str(self.screen / "Xauthority")}
        subprocess.run(["xdotool", *words], env=environment, check=True, timeout=30)

    def place(self) -> list[float]:
        """Return the robot's place in the world [x, y] [m]."""
        return self.probe.latest("/truth")

    def drive_servers(self) -> Iterator[int]:
        for pid in processes.descendants(self.program.process.pid):
            with contextlib.suppress(FileNotFoundError):  # it has ended meanwhile
                if b"robotino_onboard drive" in Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" "):
                    yield pid

    def safety(self) -> str:
        return self.probe.latest("/rto3/safety")[0]


@pytest.fixture(scope="module")
def station(graph):
    return Station(graph)


def test_a_normal_start_has_no_warning_and_ends_with_what_to_do(station):
    after_banner = station.program.output.partition("  Ctrl-C ends all of it.\n\n")[2].removeprefix(
        "No sound here: no sound server answers, and there is no sound card.\n"  # as on machines for tests
    )
    assert after_banner == "The window shows the first picture. Drive there. Ctrl-C ends all of it.\n"


def test_the_window_shows_the_camera_by_webrtc(station, wait_until):
    def colours() -> int:
        left_half = grab(station.screen)[130:600:4, 40:660:4]
        return len(np.unique(left_half.reshape(-1, 3) // 16, axis=0))

    wait_until(lambda: colours() > 60, "a picture with many colours")
    wait_until(lambda: station.probe.newest("/rto3/camera_state") == ["live"], "the picture is live")
    nodes = station.probe.nodes()
    assert {"/rto3/rto_camera_receiver", "/rto3/rto_drive_link"} <= set(nodes)
    assert "/rto3/safe_omni_drive" not in nodes, "one gate, on the robot"


def test_the_pictures_age_is_measured_on_demand(station, graph):
    port = station.ports["camera_port"]
    station.probe.watch("/picture_age", "std_msgs/Float32", ["data"])
    node = graph.run(
        str(graph.workspace / "lib/rto_node/rto_camera_receiver"), "__name:=measuring", f"_sender:=127.0.0.1:{port}",
        "_measure:=true",
    )  # fmt: skip
    assert 0.0 < station.probe.newest("/picture_age")[0] < 2.0
    assert node.end() == 0


def test_w_drives_and_its_release_stops(station, wait_until):
    wait_until(lambda: station.safety() == "no command", "the gate on the robot is ready")
    begin = station.place()
    assert station.probe.newest("/rto3/careful") == ["on by default"]
    station.xdotool("mousemove", *HEADING, "click", "1")
    station.xdotool("keydown", "w")
    try:
        wait_until(lambda: math.dist(station.place(), begin) > 0.2, "the robot drives")
        # On a busy machine a scan may be late, and the robot stands for that moment.
        wait_until(lambda: station.safety() in ("clear", "limited"), "the gate lets it drive")
        wait_until(lambda: station.probe.newest("/rto3/safety")[4], "the gate on the robot sways the body")
        station.xdotool("mousemove", *CAREFUL, "click", "1")
        wait_until(lambda: station.probe.newest("/rto3/careful") == ["off"], "the window switches the careful scan off")
        wait_until(lambda: not station.probe.newest("/rto3/safety")[4], "the body sways no more")
    finally:
        station.xdotool("keyup", "w")
    wait_until(lambda: station.safety() == "no command", "nobody drives")
    wait_until(lambda: math.dist(station.place(), station.place()) < 1e-3, "the robot stands")


def test_rto_teleop_drives_through_the_gate_on_the_robot(station, graph, wait_until):
    """As the guide types it: `rosrun rto_teleop rto_teleop_keyboard`."""
    keyboard = graph.workspace / "lib/rto_teleop/rto_teleop_keyboard"
    terminal = Terminal(str(keyboard), "_scale_linear:=4", env=station.environment)
    try:
        wait_until(lambda: "Hold a key" in terminal.seen, "it says what the keys do")
        assert "through the safety gate of /rto3/rto_drive_link" in terminal.seen
        begin = station.place()
        wait_until(lambda: terminal.type("s") or math.dist(station.place(), begin) > 0.1, "a held key drives")
        processes.end(terminal.process, patience=10.0)
    finally:
        terminal.close()
    wait_until(lambda: math.dist(station.place(), station.place()) < 1e-3, "the robot stands")


def test_a_program_that_knows_no_gate_drives_through_it(station, graph, wait_until):
    def fastest() -> float:
        return max((vx for _, (_, _, vx, *_) in station.probe.seen("/rto3/safety")), default=0.0)

    begin = station.place()
    station.probe.forget("/rto3/safety")
    with graph.run("rostopic", "pub", "-r", "10", "/rto3/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.5}}"):
        wait_until(lambda: math.dist(station.place(), begin) > 0.1, "the robot drives")
        wait_until(lambda: fastest() > 0.0, "the gate says how fast")
    assert fastest() <= 0.201, "the gate's speed"
    wait_until(lambda: math.dist(station.place(), station.place()) < 1e-3, "the robot stands")


def test_pilot_and_robot_talk_by_webrtc(station, wait_until):
    """Here without a sound card: the connection stands, and both ends say what they lack."""
    url = f"http://127.0.0.1:{station.ports['sound_port']}/sound"
    wait_until(lambda: json.load(urllib.request.urlopen(url, timeout=10))["pilots"] == 1, "the pilot is at the robot")
    assert "/rto3/rto_voice" in station.probe.nodes()
    answered, answer = station.probe.call("/rto3/voice/mute_microphone", "std_srvs/SetBool", {"data": True})
    assert answered and answer["success"] and answer["message"].startswith("you: ")


def test_it_listens_where_the_table_of_sockets_says(station, wait_until):
    """While pictures and sound flow."""
    pid = station.program.process.pid
    wait_until(lambda: socket_table.agrees([pid], "robotino", station.ports), "sockets as in the table")


def test_stop_latches_on_the_robot_until_it_is_reset(station, wait_until):
    call = station.probe.call
    assert call("/rto3/stop_drive", "std_srvs/Trigger", {})[1]["success"] is True
    wait_until(lambda: station.safety() == "stopped", "the gate on the robot is stopped")
    assert station.probe.newest("/rto3/safety")[3] == 72
    assert call("/rto3/reset_stop", "std_srvs/Trigger", {})[1]["success"] is True
    wait_until(lambda: station.safety() == "no command", "the stop is reset")
    assert call("/rto3/reset_bumper", "std_srvs/Trigger", {})[1]["success"] is True


def test_a_stop_outlasts_the_drive_server(station, graph, wait_until):
    """The one that roslaunch starts again knows nothing of it, until the robot's link tells it."""
    call = station.probe.call
    assert call("/rto3/stop_drive", "std_srvs/Trigger", {})[1]["success"] is True
    killed = set(station.drive_servers())
    for pid in killed:
        processes.send(pid, signal.SIGKILL)
    wait_until(lambda: set(station.drive_servers()) - killed, "another one starts")
    station.probe.forget("/rto3/safety")
    wait_until(lambda: station.probe.newest("/rto3/safety")[0] == "stopped", "it is stopped, too")
    station.probe.watch("/rto3/safe_cmd_vel", "geometry_msgs/Twist", ["linear.x"])
    begin = station.place()
    with graph.run("rostopic", "pub", "-r", "20", "/rto3/safe_cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.2}}"):
        wait_until(lambda: len(station.probe.seen("/rto3/safe_cmd_vel")) > 20, "a program commands for a second")
        assert math.dist(station.place(), begin) < 1e-3
    assert call("/rto3/reset_stop", "std_srvs/Trigger", {})[1]["success"] is True
    wait_until(lambda: station.safety() == "no command", "the stop is reset")


def test_copy_and_paste_as_in_the_guide(station, graph):
    """A person carries a line from the sender's terminal to the receiver's, and one back."""

    def start(*argv: str) -> subprocess.Popen:
        return processes.start(
            argv, env=station.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            text=True,
        )  # fmt: skip

    def carry(source: subprocess.Popen, target: subprocess.Popen) -> None:
        line = next(line for line in source.stdout if line.startswith("{"))
        target.stdin.write(line)
        target.stdin.flush()

    station.probe.watch("/pasted", "sensor_msgs/Image", ["width", "encoding"])
    library = graph.workspace / "lib"
    sender = start(
        str(library / "rto_bringup/robotino_onboard"), "camera", "--copy-paste", "--address", "127.0.0.1", "--source",
        "test", "--size", "320x240",
    )  # fmt: skip
    receiver = start(
        str(library / "rto_node/rtc_webcam"), "__name:=pasting", "_address:=127.0.0.1", "img_raw:=/pasted",
    )  # fmt: skip
    try:
        carry(sender, receiver)
        carry(receiver, sender)
        assert station.probe.newest("/pasted") == [320, "bgr8"]
        assert processes.end(sender, patience=10.0) == 0
        assert receiver.wait(20) == 0, "the sender's goodbye ends the receiver"
    finally:
        for program in (sender, receiver):
            processes.end(program, patience=10.0)
            program.stdin.close()
            program.stdout.close()


def test_without_the_drive_server_nothing_is_free_and_the_pilot_knows(station, wait_until):
    """roslaunch brings it back, as systemd does on a robot."""

    assert list(station.drive_servers())

    def is_told():
        for pid in station.drive_servers():  # it comes back sooner than anybody misses it
            processes.send(pid, signal.SIGKILL)
        state, reason = station.probe.latest("/rto3/safety")[:2]
        return state == "fault" and "drive server" in reason  # one that has just come back gives reasons of its own

    wait_until(is_told, "the pilot is told")
    wait_until(lambda: station.safety() == "no command", "it is back")


def test_nothing_is_left_after_the_next_start_when_all_of_it_is_killed(station, wait_until):
    """The next start begins with `sweep`; what is killed at once cannot clean up."""
    pid, folder, display = station.program.process.pid, station.screen.parent, station.screen / "number"
    number = display.read_text()
    assert folder.name.startswith(station_folder.PREFIX)
    for killed in (pid, *processes.descendants(pid)):
        processes.send(killed, signal.SIGKILL)
    wait_until(lambda: station.program.process.poll() is not None, "it is dead")
    sweep = "from telepresence.station import station_folder; print(*station_folder.sweep(), sep='\\n')"
    answer = subprocess.run(
        [sys.executable, "-c", sweep], env=station.environment, capture_output=True, text=True, timeout=60
    )
    assert str(folder) in answer.stdout.splitlines(), answer.stdout + answer.stderr
    assert not folder.exists()
    assert not Path(f"/tmp/.X{number}-lock").exists() and not Path(f"/tmp/.X11-unix/X{number}").exists()
    mark = f"{station_folder.VARIABLE}={folder}".encode()

    def left() -> list[str]:
        found = []
        for environment in Path("/proc").glob("[0-9]*/environ"):
            with contextlib.suppress(OSError):
                if mark in environment.read_bytes():
                    found.append((environment.parent / "cmdline").read_text())
        return found

    assert not left()
