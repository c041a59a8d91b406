"""A station as a person brings it up, `./stack up`, and who watches it from outside: where its robots truly are, what
it says about itself, which processes it has."""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ros_graph import free_port
from telepresence_ros.pseudo_terminal import Terminal

from telepresence.station import processes
from telepresence.station.ros_master import master_answers, master_proxy

from .service import Service
from .topics import CALLER, TopicReader
from .trace import Sample
from .victims import frozen, victims

ROOT = Path(__file__).resolve().parents[3]
UP_TIMEOUT = 90.0
SILENCE = 0.5
LEAVE = 5.0
"""What a killed station leaves behind may take so long to end by itself [s]."""
MANAGER = ("systemd", "(sd-pam)")
"""What systemd itself runs in the place of a person."""
ORDINARY = {"clear", "limited", "blocked", "no command"}
"""States of the gate that say nothing about a fault while a key is held or has just been released."""


@dataclass(frozen=True)
class Robot:
    """A robot of a station.

    Args:
        name: `pepper` or `robotino`.
        namespace: Of its gate and its lease.
        command: Where programs drive it.
        truth: Where it truly is.
        speed: It is driven at [m/s], what the window begins with.
    """

    name: str
    namespace: str
    command: str
    truth: str
    speed: float


PEPPER = Robot("pepper", "", "/cmd_vel", "/truth", 0.2)
ROBOTINO = Robot("robotino", "/rto3", "/rto3/safe_cmd_vel", "/truth", 0.2)
STATIONS: dict[str, tuple[Robot, ...]] = {
    "pepper": (PEPPER,),
    "robotino": (ROBOTINO,),
    "both": (PEPPER, Robot("robotino", "/rto3", "/rto3/safe_cmd_vel", "/rto3/truth", 0.2)),
}
PORTS = {
    "pepper": ("nao_port", "drive_port", "page_port", "robot_page_port", "pilot_page_port", "screen_port"),
    "robotino": ("robotino_port", "drive_port", "camera_port", "sound_port", "pilot_page_port", "screen_port"),
    "both": (
        "nao_port",
        "pepper_drive_port",
        "page_port",
        "robot_page_port",
        "robotino_port",
        "drive_port",
        "camera_port",
        "sound_port",
        "pilot_page_port",
        "screen_port",
    ),
}


@dataclass(frozen=True)
class Sentence:
    """What the station said about itself: when (monotonic [s]), where, what."""

    time: float
    where: str
    text: str


class Truth:
    """Where a robot truly is, as its simulator publishes it, with the simulator's own time stamps."""

    def __init__(self, master: str, topic: str, enter: Callable[[], None] | None = None) -> None:
        self._samples: deque[Sample] = deque(maxlen=50 * 120)
        self._offset = time.time() - time.monotonic()
        self._reader = TopicReader(master, topic, self._receive, enter)

    def _receive(self, message: Any) -> None:
        q, p, twist = message.pose.pose.orientation, message.pose.pose.position, message.twist.twist
        yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        vx, vy = twist.linear.x, twist.linear.y
        stamp = message.header.stamp.to_sec() - self._offset
        self._samples.append(Sample(stamp, p.x, p.y, yaw, vx, math.hypot(vx, vy), twist.angular.z))

    def since(self, when: float) -> list[Sample]:
        return [sample for sample in list(self._samples) if sample.time >= when]

    @property
    def newest(self) -> Sample | None:
        """None also when it is older than a fifth of a second."""
        samples = self._samples
        return samples[-1] if samples and time.monotonic() - samples[-1].time < 0.2 else None

    @property
    def silent(self) -> bool:
        """Whether the simulator has said nothing for half a second: it is gone, not only late."""
        samples = self._samples
        return not samples or time.monotonic() - samples[-1].time > SILENCE

    def close(self) -> None:
        self._reader.close()


class Sayings:
    """What a station says about itself: its topics, and the lines of its window."""

    def __init__(self) -> None:
        self._sentences: deque[Sentence] = deque(maxlen=5000)
        self._last: dict[str, str] = {}

    def add(self, where: str, text: str, when: float | None = None) -> None:
        """Note a sentence, said `when` [monotonic s] or now, if it is not the one that was there before."""
        if self._last.get(where) != text:
            self._last[where] = text
            if text:
                self._sentences.append(Sentence(time.monotonic() if when is None else when, where, text))

    def fault(self, message: Any) -> None:
        """A fault that the station has published; the last one comes again with every connection."""
        self.add("faults", f"{message.program} {message.what}; {message.next} [{message.stamp.to_sec():.2f}]")

    def safety(self, message: Any) -> None:
        self.add("safety", "" if message.state in ORDINARY else message.reason or message.state)

    def lease(self, message: Any) -> None:
        self.add("lease", message.hold)

    def window(self, line: str) -> None:
        """A line of the station's output: what the window shows has its time and level before it. A station that is
        frozen passes it on when it is woken."""
        match = re.match(r"(\d{4}-\d\d-\d\d [\d:.]+) [^,]*, (warn|bad): (.*)", line)
        if match:
            self._last.pop("window", None)
            ago = time.time() - datetime.fromisoformat(match[1]).timestamp()
            self.add("window", match[3], time.monotonic() - ago)

    def since(self, when: float) -> list[Sentence]:
        return [sentence for sentence in list(self._sentences) if sentence.time >= when]


class Output:
    """What a station prints: its newest lines, and for good the display of its window, which it names only once."""

    def __init__(self) -> None:
        self.lines: deque[str] = deque(maxlen=400)
        self.display = ""

    def add(self, line: str) -> None:
        self.lines.append(line.rstrip())
        if match := re.search(r"virtual one \((:\d+)\)", line):
            self.display = match[1]


class Station:
    """`./stack up` with free ports and a master of its own, until closed.

    Args:
        kind: One of STATIONS.
        by: `window`, `terminal` or `topic`.
        folder: For what it writes.
        service: systemd starts it, from the unit that `./stack service` prints.
    Raises:
        RuntimeError: It does not come up.
    """

    def __init__(self, kind: str, by: str, folder: Path, service: bool = False) -> None:
        self.kind, self.by, self.robots = kind, by, STATIONS[kind]
        self.master = f"http://127.0.0.1:{free_port()}"
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": self.master,
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            "XDG_CONFIG_HOME": str(folder / "config"),
            "TELEPRESENCE_AS_ROOT": "1",
        }
        self.environment.pop("DISPLAY", None)
        self.sayings = Sayings()
        self.output = Output()
        ports = {name: free_port() for name in PORTS[kind]}
        settings = {**{name: str(port) for name, port in ports.items()}, "terrain": "flat"}
        settings["gui"] = "true" if by == "window" else "false"
        if kind != "robotino":
            settings["source"] = "test"
        if by == "window":
            settings["gui_options"] = "--tell"
        settled = (f"{name}:={value}" for name, value in settings.items())
        arguments = [kind, *settled]
        words = [str(ROOT / "stack"), "up", "--verbose", *arguments]
        self.terminal: Terminal | None = None
        self._service: Service | None = None
        if service:
            self._service = Service(arguments, self.environment, folder)
            self.process = self._service.manager
            self._read_from(self._service.output)
        elif by == "terminal":
            self.terminal = Terminal(*words, env=self.environment)
            self.process = self.terminal.process
        else:
            self.process = processes.start(
                words, tied=True, env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, errors="replace",
            )  # fmt: skip
            assert self.process.stdout is not None
            self._read_from(self.process.stdout)
        self.truths = {robot.name: Truth(self.master, robot.truth) for robot in self.robots}
        self._readers = [TopicReader(self.master, "/station/faults", self.sayings.fault)]
        for robot in self.robots:
            self._readers += [
                TopicReader(self.master, f"{robot.namespace}/safety", self.sayings.safety),
                TopicReader(self.master, f"{robot.namespace}/drive/state", self.sayings.lease),
            ]
        self.names: set[str] = set()
        self._seen: set[int] = set()

    def _read_from(self, lines: Iterable[str]) -> None:
        def read() -> None:
            for line in lines:
                self.output.add(line)
                self.sayings.window(line)

        threading.Thread(target=read, name="station-output", daemon=True).start()

    @property
    def label(self) -> str:
        """What its rows are called."""
        return f"{self.kind}, service" if self.supervised else self.kind

    @property
    def supervised(self) -> bool:
        """Whether systemd keeps it."""
        return self._service is not None

    @property
    def running(self) -> bool:
        return self.process.poll() is None

    @property
    def display(self) -> dict[str, str]:
        """The environment of the station's virtual display."""
        for pid in self.victims().values():
            words = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
            if self.output.display and words[0] == "Xvfb":
                folder = Path(words[words.index("-fbdir") + 1])
                return {"DISPLAY": self.output.display, "XAUTHORITY": str(folder / "Xauthority")}
        raise RuntimeError("the station has no virtual display")

    def victims(self) -> dict[str, int]:
        """Its processes by name. Those that it leaves behind when it is killed are remembered and ended by `close`."""
        found = victims(self.process.pid)
        for name in MANAGER if self.supervised else ():
            found.pop(name, None)
        self._seen |= {*found.values()}
        return found

    def wait(self, condition: Callable[[], object], what: str, timeout: float) -> None:
        """Raise RuntimeError unless the condition holds in time, or as soon as the station has ended."""
        deadline = time.monotonic() + timeout
        while not condition():
            if not self.running:
                raise RuntimeError(f"the station ended while it was waited for: {what}\n" + self.last_lines())
            if time.monotonic() > deadline:
                raise RuntimeError(f"{what}: not within {timeout:.0f} s\n" + self.last_lines())
            time.sleep(0.05)

    def last_lines(self) -> str:
        seen = self.terminal.seen.splitlines() if self.terminal is not None else list(self.output.lines)
        return "\n".join(seen[-15:])

    def wait_ready(self) -> None:
        """Until all its programs are there: the master answers, the robots are seen, no node comes any more."""
        self.wait(lambda: master_answers(self.master), "the ROS master", UP_TIMEOUT)
        self.wait(lambda: all(truth.newest for truth in self.truths.values()), "the simulated robots", UP_TIMEOUT)
        if self.by == "window":
            shown = lambda: any("first picture" in line for line in self.output.lines)  # noqa: E731
            self.wait(shown, "the first picture", UP_TIMEOUT)
        known: dict[str, int] = {}
        since = time.monotonic()

        def settled() -> bool:
            nonlocal known, since
            now = self.victims()
            if now != known:
                known, since = now, time.monotonic()
            return time.monotonic() - since > 3.0

        self.wait(settled, "all its programs", UP_TIMEOUT)
        self.names = set(known)

    def complete(self) -> bool:
        """Whether every process that it began with is there and runs."""
        now = self.victims()
        return self.running and self.names <= set(now) and not any(frozen(pid) for pid in now.values())

    def nodes(self) -> int:
        master: Any = master_proxy(self.master, timeout=2.0)
        state = master.getSystemState(CALLER)[2]
        return len({node for group in state for _, names in group for node in names})

    def close(self) -> None:
        """End everything, also what is frozen."""
        self.victims()
        for pid in self._own():
            if frozen(pid):
                processes.send(pid, signal.SIGCONT)
        for reader in (*self._readers, *self.truths.values()):
            reader.close()
        if self._service is not None:
            self._service.close()
        elif self.terminal is not None:
            self.terminal.close()
        else:
            processes.end(self.process, patience=15.0)
        deadline = time.monotonic() + LEAVE
        while self._own() and time.monotonic() < deadline:
            time.sleep(0.05)
        for pid in self._own():
            processes.send(pid, signal.SIGKILL)

    def _own(self) -> set[int]:
        """What is still there of all processes that it had: this process adopts those that lost their parents."""
        return {*processes.descendants()} & self._seen
