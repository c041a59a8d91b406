"""`./stack up` dies where systemd keeps it: the station goes on, and the next one takes it over, or nothing is left."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from faults.pilots import TopicPilot
from faults.topics import TopicReader

from telepresence.station import absence, processes, program_registry, station_folder, vitals
from telepresence.station.ros_master import master_answers, master_proxy
from telepresence.station.virtual_display import display_answers

pytestmark = [pytest.mark.ros, pytest.mark.x11, pytest.mark.station]

ROOT = Path(__file__).resolve().parent.parent
PORTS = ("robotino_port", "drive_port", "camera_port", "sound_port", "pilot_page_port", "screen_port")


class Kept:
    """A station whose `./stack up` is started again by `start`, as systemd would, with the same arguments."""

    def __init__(self, folder: Path, free_port: Callable[[], int], *settings: str) -> None:
        self.master = f"http://127.0.0.1:{free_port()}"
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": self.master,
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            absence.VARIABLE: "1",
        }
        self.environment.pop("DISPLAY", None)
        self._printed = folder / "printed"
        self._words = [str(ROOT / "stack"), "up", "robotino", *settings, *(f"{name}:={free_port()}" for name in PORTS)]
        self.start()

    def start(self) -> None:
        with self._printed.open("w") as printed:
            self.process = subprocess.Popen(
                self._words, env=self.environment, stdin=subprocess.DEVNULL, stdout=printed, stderr=subprocess.STDOUT
            )

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    @property
    def printed(self) -> str:
        return self._printed.read_text()

    @property
    def programs(self) -> dict[int, Path]:
        """Its programs, with the station's folder."""
        found = {}
        for process in Path("/proc").glob("[0-9]*"):
            try:
                words = (process / "environ").read_bytes().split(b"\0")
            except OSError:
                continue
            if f"ROS_MASTER_URI={self.master}".encode() in words:
                place = next((w for w in words if w.startswith(f"{station_folder.VARIABLE}=".encode())), b"=")
                found[int(process.name)] = Path(os.fsdecode(place.partition(b"=")[2]))
        return {pid: place for pid, place in found.items() if vitals.start_time(pid)}

    @property
    def folder(self) -> Path:
        (folder,) = {place for place in self.programs.values() if place.name}
        return folder

    @property
    def nodes(self) -> dict[str, int]:
        """The nodes' process ids, as roslaunch has written them down."""
        return {node.name: node.pid for node in program_registry.everything(self.folder / "watch") if node.lives}

    def program(self, word: str) -> int:
        """The process id of the program whose command line has this word; 0 for none."""
        for pid in self.programs:
            with contextlib.suppress(OSError):  # it has just ended
                if word in Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0"):
                    return pid
        return 0

    def end(self) -> None:
        processes.end(self.process, patience=30.0)
        for pid in self.programs:
            processes.send(pid, signal.SIGKILL)


@pytest.fixture
def begin(tmp_path, free_port) -> Iterator[Callable[..., Kept]]:
    stations: list[Kept] = []

    def start(*settings: str) -> Kept:
        stations.append(Kept(tmp_path, free_port, *settings))
        return stations[-1]

    yield start
    for station in stations:
        station.end()


def test_the_next_one_takes_over_and_the_robot_drives_on(begin, wait_until):
    station = begin("terrain:=flat")
    wait_until(lambda: "first picture" in station.printed, "the window shows the first picture", timeout=120.0)
    link = re.search(r"https://\S+", station.printed)[0]
    speeds: deque[float] = deque(maxlen=10_000)
    reader = TopicReader(station.master, "/truth", lambda message: speeds.append(message.twist.twist.linear.x))
    pilot = TopicPilot(station.environment, "/rto3/safe_cmd_vel", 0.1)
    try:
        pilot.hold()
        wait_until(lambda: speeds and speeds[-1] > 0.08, "Robotino drives")
        before = station.nodes
        master, launch = map(station.program, ("telepresence_ros.core", "telepresence_ros.roslaunch"))
        wait_until((station.folder / absence.FILE).exists, "every node was started")
        station.kill()
        station.start()
        wait_until(lambda: "is taken over" in station.printed, "another one takes over", timeout=60.0)
        speeds.clear()
        wait_until(lambda: [speed for speed in speeds if speed > 0.08], "it drives on")
    finally:
        pilot.close()
        reader.close()
    assert station.nodes == before
    assert [station.program(word) for word in ("telepresence_ros.core", "telepresence_ros.roslaunch")] == [
        master,
        launch,
    ]
    assert re.search(r"https://\S+", station.printed)[0] == link, "the link that a pilot has still holds"
    display = re.search(r"virtual one \((:\d+)\)", station.printed)[1]
    assert display_answers(display)

    restarts = [
        ("telepresence_ros.core", master), ("telepresence_ros.roslaunch", launch), ("Xvfb", station.program("Xvfb")),
    ]  # fmt: skip
    for _, pid in restarts:
        os.kill(pid, signal.SIGKILL)
    wait_until(lambda: not vitals.start_time(master), "the master has ended")
    wait_until(lambda: master_answers(station.master) and display_answers(display), "what it went on with is kept, too")
    assert master_proxy(station.master, timeout=5.0).hasParam("/test", "/rto3/safe_keyboard_teleop")[2] is not None
    wait_until(lambda: all(station.program(word) not in (0, pid) for word, pid in restarts), "all of it runs again")

    station.process.send_signal(signal.SIGINT)
    assert station.process.wait(60.0) == 0
    wait_until(lambda: not station.programs, "nothing is left")


def test_without_a_next_one_everything_ends(begin, wait_until):
    station = begin("gui:=false", "page:=false")
    wait_until(lambda: "Everything is started" in station.printed, "it is up", timeout=120.0)
    station.kill()
    killed = time.monotonic()
    wait_until(lambda: not station.programs, "its programs end", timeout=absence.WAITS + 45.0)
    assert time.monotonic() - killed > 0.5 * absence.WAITS, "they waited for a next one"


def test_another_station_is_not_taken_over(begin, wait_until):
    station = begin("gui:=false", "page:=false")
    wait_until(lambda: "Everything is started" in station.printed, "it is up", timeout=120.0)
    before = station.nodes
    station.kill()
    station._words.append("voice:=false")
    station.start()
    wait_until(lambda: "Everything is started" in station.printed, "the other one is up", timeout=120.0)
    assert "is taken over" not in station.printed and "Left by a station that was killed" in station.printed
    assert not {*station.nodes.values()} & {*before.values()}
