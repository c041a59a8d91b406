"""`./stack up` as a whole: window, camera, keyboard, tablet, faults, and nothing left behind.

One station serves all tests of this file, on ports and a display of its own; they run in the order of the file, and the
last one ends it.
"""

from __future__ import annotations

import getpass
import json
import math
import os
import queue
import re
import signal
import subprocess
import threading
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import socket_table
from faults.topics import TopicReader
from newcomer import SCREENS, Newcomer
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.station.virtual_display import grab

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = {
    "/robot_control_node",
    "/pepper_publisher",
    "/naoqi_driver",
    "/pepper_robot/pepper_sonar",
    "/pepper_robot/pepper_laser",
    "/pepper_robot/pose/pose_manager",
    "/pepper_robot/camera/front",
    "/com_cam",
    "/teleop_twist_keyboard",
}
"""The eight programs of the original, and the simulator."""


class Station:
    """A running `./stack up pepper` and what a person in front of it can see and do."""

    def __init__(self, environment: dict[str, str], ports: dict[str, int]) -> None:
        self.environment = environment
        self.ports = {**ports, "ROS_MASTER_URI": int(environment["ROS_MASTER_URI"].rpartition(":")[2])}
        self.terminal = Terminal(
            str(ROOT / "stack"),
            "up",
            "pepper",
            *(f"{name}:={port}" for name, port in ports.items()),
            "source:=test",
            "front_frame_rate:=8",
            env=environment,
        )
        self.process = self.terminal.process

    @property
    def lines(self) -> list[str]:
        """What the terminal shows."""
        return self.terminal.seen.replace("\r", "").splitlines(keepends=True)

    def said(self, text: str) -> bool:
        if self.process.poll() is not None:
            pytest.fail("the station ended:\n" + "".join(self.lines[-40:]))
        return any(text in line for line in self.lines)

    @property
    def output(self) -> str:
        """What its programs have printed, which goes to a file."""
        return Path(re.search(r"output +(\S+)", "".join(self.lines))[1]).read_text()

    @property
    def display(self) -> str:
        return re.search(r"virtual one \((:\d+)\)", "".join(self.lines)).group(1)

    @property
    def screen(self) -> Path:
        """The folder that the station's Xvfb writes its screen to."""
        for pid in processes.descendants(self.process.pid):
            words = command(pid).split()
            if words and words[0] == "Xvfb":
                return Path(words[words.index("-fbdir") + 1])
        pytest.fail("the station has no virtual display")

    def looked_at_by(self) -> list[str]:
        """Whom Pepper's tablet names."""
        place, _, key = re.search(r"tablet page  (\S+)", "".join(self.lines))[1].partition("?")
        with urllib.request.urlopen(f"{place}status?{key}", timeout=10.0) as answer:
            return json.load(answer)["looking"]

    def nodes(self) -> set[str]:
        state = master_proxy(self.environment["ROS_MASTER_URI"], timeout=5.0).getSystemState("/test")[2]
        return {node for group in state for _, nodes in group for node in nodes}

    def run(self, *argv: str, timeout: float = 60.0) -> str:
        answer = subprocess.run(argv, env=self.environment, capture_output=True, text=True, timeout=timeout)
        assert answer.returncode == 0, f"{argv}: {answer.stdout}{answer.stderr}"
        return answer.stdout

    def type_in_terminal(self, key: str) -> None:
        """Click into the embedded terminal and press a key there, as a person would."""
        environment = {**self.environment, "DISPLAY": self.display, "XAUTHORITY": str(self.screen / "Xauthority")}

        def xdotool(*words: str) -> str:
            return subprocess.run(
                ["xdotool", *words], env=environment, capture_output=True, text=True, check=True, timeout=30
            ).stdout

        window = xdotool("search", "--class", "XTerm").split()[-1]
        xdotool("mousemove", "--window", window, "60", "60", "click", "1")
        xdotool("key", key)

    def next_message(self, topic: str) -> Any:
        """What `rostopic echo -n1` would print, without a second of Python's start."""
        messages: queue.Queue[Any] = queue.Queue()
        reader = TopicReader(self.environment["ROS_MASTER_URI"], topic, messages.put)
        try:
            return messages.get(timeout=30.0)
        finally:
            reader.close()

    def truth(self) -> np.ndarray:
        """Position of the robot in the world (x, y) [m]."""
        position = self.next_message("/truth").pose.pose.position
        return np.array((position.x, position.y))

    def speed(self, seconds: float = 0.5) -> float:
        begin, when = self.truth(), time.monotonic()
        threading.Event().wait(seconds)
        return float(np.linalg.norm(self.truth() - begin) / (time.monotonic() - when))


def command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def running() -> dict[int, str]:
    """Every process that is alive, by id."""
    return {int(path.name): command(int(path.name)) for path in Path("/proc").glob("[0-9]*") if command(int(path.name))}


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory, free_port: Callable[[], int], wait_until: Callable):
    environment = {
        **os.environ,
        "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
        "ROS_HOME": str(tmp_path_factory.mktemp("ros")),
        "ROS_IP": "127.0.0.1",
    }
    environment.pop("DISPLAY", None)
    station = Station(
        environment,
        {
            name: free_port()
            for name in ("nao_port", "drive_port", "page_port", "robot_page_port", "pilot_page_port", "screen_port")
        },
    )
    try:
        wait_until(lambda: station.said("first picture"), "the window shows the first picture", timeout=120.0)
        yield station
    finally:
        processes.end(station.process, patience=30.0)
        station.terminal.close()


def test_a_normal_start_fits_one_screen_without_a_warning_and_ends_with_what_to_do(station, wait_until):
    wait_until(lambda: station.lines[-1].startswith("Ctrl-C"), "it has said all")
    text = "".join(station.lines)
    assert sum(max(1, math.ceil((len(line) - 1) / 80)) for line in station.lines) <= 24, text
    link = re.search(r"pilot's page (https://\S+)", text)[1]
    after_banner = text.partition("  Ctrl-C ends all of it.\n\n")[2].removeprefix(
        "No sound here: no sound server answers, and there is no sound card.\n"  # as on machines for tests
    )
    next_steps = (
        f"The window shows the first picture. Drive there, or in any browser:\n  {link}\nCtrl-C ends all of it.\n"
    )
    assert after_banner == next_steps, text
    wait_until(
        lambda: "PARAMETERS" in station.output and "connected to the robot" in station.output, "the rest is kept"
    )
    assert "?k=" not in station.output, "a key is in a log"


def test_the_window_shows_the_robots_camera(station, wait_until):
    """The picture is large and colourful: neither empty nor a grey card."""

    def colours() -> int:
        left_half = grab(station.screen)[110:640:4, 30:730:4]
        return len(np.unique(left_half.reshape(-1, 3) // 16, axis=0))

    wait_until(lambda: colours() > 100, "a picture with many colours")


def test_the_original_programs_and_the_simulator_are_nodes(station, wait_until):
    wait_until(lambda: PROGRAMS <= station.nodes(), "all programs are registered")
    assert PROGRAMS <= set(station.run("rosnode", "list").split())


@pytest.fixture(scope="module")
def moves(station) -> Callable[[], float]:
    """Metres that the robot has moved since the last call of `moves.restart`."""
    places: list[np.ndarray] = []
    reader = TopicReader(
        station.environment["ROS_MASTER_URI"],
        "/truth",
        lambda message: places.append(np.array([message.pose.pose.position.x, message.pose.pose.position.y])),
    )

    def moved() -> float:
        return float(np.linalg.norm(places[-1] - places[0])) if places else 0.0

    moved.restart = places.clear
    yield moved
    reader.close()


@pytest.mark.parametrize("screen", SCREENS, ids=lambda screen: screen.name)
def test_a_newcomer_opens_the_link_sees_and_drives(station, moves, wait_until, screen):
    """Nothing is read and nothing is filled in: a tap on the link that the terminal shows, then forward is held. How
    long it takes is measured by `./stack bench newcomer`."""
    link = re.search(r"pilot's page (https://\S+)", "".join(station.lines))[1]
    newcomer = Newcomer(screen)
    try:
        newcomer.tap(link)
        wait_until(newcomer.is_there, "the picture is there, and the window has let go of the robot")
        moves.restart()
        wait_until(lambda: newcomer.insists() and moves() > 0.05, "the robot drives")
        if folder := os.environ.get("NEWCOMER_PICTURES"):  # for docs/page.md
            Path(folder, f"pilot_page_{screen.name}.png").write_bytes(newcomer.picture())
        newcomer.let_go()
        wait_until(newcomer.holds_nothing, "the page lets go")
        wait_until(lambda: station.speed() < 0.01, "the robot stands")
        wait_until(lambda: station.looked_at_by() == [getpass.getuser()], "Pepper's tablet says who looks")
        assert "#" not in newcomer.evaluate("location.href"), "the key stays in the address bar"
        assert newcomer.errors == []
    finally:
        newcomer.tools.close()


def test_it_listens_where_the_table_of_sockets_says(station, wait_until):
    wait_until(lambda: socket_table.agrees([station.process.pid], "pepper", station.ports), "sockets as in the table")


def test_a_killed_roslaunch_comes_back_and_no_node_notices(station, wait_until):
    tree = {pid: command(pid) for pid in processes.descendants(station.process.pid)}
    (killed,) = [pid for pid, words in tree.items() if "telepresence_ros.roslaunch" in words]
    os.kill(killed, signal.SIGKILL)
    wait_until(lambda: station.output.count("goes on with pid") > len(PROGRAMS), "nodes are adopted")
    assert {pid for pid, words in tree.items() if "__name:=" in words} <= {*processes.descendants(station.process.pid)}


def test_a_killed_roscore_stops_the_robot_and_comes_back_though_the_terminal_is_paused(station, wait_until):
    station.terminal.pause()

    def turns() -> bool:
        station.type_in_terminal("j")
        return "driving" in station.next_message("/drive_state").data

    wait_until(turns, "Pepper turns")
    killed = [p for p in processes.descendants(station.process.pid) if "telepresence_ros.core" in command(p)]
    assert len(killed) == 1
    for pid in killed:
        os.kill(pid, signal.SIGKILL)
    uri = station.environment["ROS_MASTER_URI"]
    wait_until(lambda: not master_answers(uri), "roscore has ended")
    wait_until(lambda: master_answers(uri) and PROGRAMS <= station.nodes(), "every program is known to the new master")
    wait_until(lambda: station.speed() < 0.01, "Pepper stands: nobody has pressed a key since")
    begin = station.truth()
    station.type_in_terminal("comma")
    wait_until(lambda: np.linalg.norm(station.truth() - begin) > 0.1, "driving goes on")
    station.type_in_terminal("k")
    assert not station.said("roscore is back")
    station.terminal.resume()
    wait_until(lambda: station.said("roscore is back"), "the terminal shows what has happened")


def test_a_killed_robot_comes_back_though_its_drivers_warn_a_paused_terminal(station, wait_until):
    warned = station.terminal.seen.count("[WARN]")
    station.terminal.pause()
    before = {pid for pid in processes.descendants(station.process.pid) if "__name:=robot_control_node" in command(pid)}
    assert len(before) == 1
    os.kill(*before, signal.SIGKILL)

    def drives() -> bool:
        station.type_in_terminal("comma")
        return station.speed() > 0.05

    wait_until(lambda: "/robot_control_node" in station.nodes() and drives(), "the new robot is driven")
    station.type_in_terminal("k")
    assert station.terminal.seen.count("[WARN]") == warned
    station.terminal.resume()
    wait_until(lambda: station.terminal.seen.count("[WARN]") > warned, "the terminal shows what has happened")


def test_ctrl_c_leaves_nothing_behind(station, wait_until):
    screen = station.screen
    ours = set(processes.descendants(station.process.pid)) | {station.process.pid}
    names = " ".join(running()[pid] for pid in ours if pid in running())
    for part in ("Xvfb", "tmux", "xterm", "telepresence_ros.core", "telepresence_ros.roslaunch", "pepper_sim"):
        assert part in names, f"{part} was expected to run"
    marker = station.environment["ROS_MASTER_URI"].encode()
    station.terminal.type("\x03")
    wait_until(lambda: station.process.poll() is not None, "the station ends", timeout=60.0)
    assert station.process.returncode == 0

    def left() -> list[str]:
        """What it started, or what carries its master's address in the environment: daemons leave their parents."""
        found = []
        for pid, words in running().items():
            try:
                mine = marker in Path(f"/proc/{pid}/environ").read_bytes()
            except OSError:
                continue
            if pid in ours or mine:
                found.append(words)
        return found

    wait_until(lambda: not left(), f"nothing is left, but there is {left()}")
    assert not screen.exists()
