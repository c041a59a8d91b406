"""A station for a soak: `./stack up both` on one machine, two simulated robots on another, a bad link between them.

The machines are network namespaces, the link carries every packet between pilot and robots: NAOqi, REST, drive
datagrams, WebRTC, sound, the tablet's page (see media/far_network.py; needs root). What does not cross it: the ROS
graph, which is on the pilot's machine only, and what the onboard programs ask of their own robot.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from media.far_network import FarNetwork

from telepresence.security.robot_key import RobotKey
from telepresence.station import processes
from telepresence.station.plan import HEAP
from telepresence.web.page_auth import make_token

ROOT = Path(__file__).resolve().parents[3]
NODES = ROOT / "catkin_ws" / "devel" / "lib"
PAGE_PORT, REST_PORT = 10002, 8080
STARTS = 120.0
"""[s] until the window shows a picture."""
RETURN_PERIOD = 0.5
"""After this time [s] a program on the robots' machine is started again: there systemd does it."""


class Station:
    """The running station; `folder` gets all its files, its logs among them.

    Args:
        seed: Start of the simulated sensors' noise and of the link's losses.
        loss: Share of the packets that the link loses, each way.
        note: Called with what happened, for the record.
    """

    def __init__(self, folder: Path, seed: int, loss: float, note: Callable[[str, str], None]) -> None:
        self.folder, self._note = folder, note
        self.logs = [folder / "ros", folder / "printed"]
        for each in self.logs:
            each.mkdir(parents=True, exist_ok=True)
        os.environ["XDG_CONFIG_HOME"] = str(folder / "config")  # the pilot's store of keys
        self.network = FarNetwork(2, seed)
        self.network.loss = loss
        self.pilot, self.robot = self.network.machines
        self._page_key = make_token()
        self.environment = {
            **os.environ,
            **HEAP,  # the simulated robots, too, have it from `./stack up` otherwise
            "ROS_MASTER_URI": "http://127.0.0.1:11311",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "ros"),
            "TELEPRESENCE_AS_ROOT": "1",
            "TELEPRESENCE_PAGE_KEY": self._page_key,
            "TELEPRESENCE_SETTINGS": str(folder / "config" / "settings.json"),
            "PYTHONUNBUFFERED": "1",
        }
        self.environment.pop("DISPLAY", None)
        self._kept: dict[str, tuple[list[str], subprocess.Popen, float]] = {}
        self._passing: list[tuple[float, subprocess.Popen]] = []
        self.measuring: set[int] = set()
        """Processes that only watch the station."""
        self._start_robots(seed)
        self.up = self._start_up()

    @property
    def page_url(self) -> str:
        """The tablet's page, as the robots' machine reaches it, without its key."""
        return f"http://{self.pilot.address}:{PAGE_PORT}"

    @property
    def display(self) -> dict[str, str]:
        """What a program needs to use the display of the operator's window; empty when there is none now."""
        for pid in processes.descendants(self.up.pid):
            if "gui_ros_node" in " ".join(command(pid)):
                words = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace").split("\0")
                found = dict(word.split("=", 1) for word in words if word.startswith(("DISPLAY=", "XAUTHORITY=")))
                if len(found) == 2:
                    return found
        return {}

    def pids(self) -> list[int]:
        """Return the processes of the station: all that we have started, but for viewers and what measures."""
        roots = [self.up.pid, *(program.pid for _, program, _ in self._kept.values())]
        others = {viewer.pid for _, viewer in self._passing} | self.measuring
        others |= {pid for other in [*others] for pid in processes.descendants(other)}
        # Orphans, such as tmux, are ours, too: we adopt them.
        return [*roots, *(pid for pid in processes.descendants() if pid not in others and pid not in roots)]

    def on_pilot(self, *argv: str, **popen: object) -> subprocess.Popen:
        """Start a program on the pilot's machine, in the station's environment."""
        return processes.start(
            self.pilot.command(*argv),
            tied=True,
            env={**self.environment, **popen.pop("env", {})},  # type: ignore[dict-item]
            stdin=subprocess.DEVNULL,
            **{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **popen},
        )

    def passing(self, machine: str, seconds: float, *argv: str, **environment: str) -> None:
        """Run a program on a machine ("pilot" or "robot") for so many seconds; `look_after` ends it."""
        place = self.pilot if machine == "pilot" else self.robot
        viewer = processes.start(
            place.command(*argv),
            tied=True,
            env={**self.environment, **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._passing.append((time.monotonic() + seconds, viewer))

    def look_after(self) -> None:
        """Start the robots' programs again that have died, end the viewers whose time is over, restart what ended."""
        now = time.monotonic()
        for name, (argv, program, since) in [*self._kept.items()]:
            if program.poll() is not None and now - since > RETURN_PERIOD:
                self._note("robot's program restarted", f"{name}: exit code {program.returncode}")
                self._keep(name, *argv)
        for end, viewer in [*self._passing]:
            if viewer.poll() is not None or now > end:
                self._passing.remove((end, viewer))
                _end_quickly(viewer)
        if self.up.poll() is not None:
            self._note("station ended", f"exit code {self.up.returncode}: started again")
            self.up = self._start_up()

    def close(self) -> None:
        for _, viewer in self._passing:
            _end_quickly(viewer)
        processes.end(self.up, patience=20.0)
        for _, program, _ in self._kept.values():
            processes.send(program.pid, signal.SIGINT)
        for _, program, _ in self._kept.values():
            processes.end(program, patience=5.0)
        self.network.close()

    def _start_robots(self, seed: int) -> None:
        address = self.robot.address
        key = self.folder / "robot.key"
        (key.unlink if key.exists() else lambda: None)()
        RobotKey.make(key).store(address)
        listen = ("--address", address, "--key", str(key))
        onboard = str(NODES / "rto_bringup" / "robotino_onboard")
        place = ("--address", address, "--seed", str(seed))
        rest = f"{address}:{REST_PORT}"
        everywhere = ("--address", "0.0.0.0", "--seed", str(seed))  # the drive server is beside NAOqi, on loopback
        self._keep("pepper_sim", sys.executable, "-m", "pepper_sim", *everywhere)
        drive_server = str(NODES / "naoqi_driver_py" / "drive_server.py")
        self._keep("drive_server", drive_server, "--qi-url", "tcp://127.0.0.1:9559", *listen)
        self._keep("robotino_sim", sys.executable, "-m", "robotino_sim", "--camera", "640x480", *place)
        self._keep("onboard_drive", onboard, "drive", "--robot", rest, *listen)
        self._keep("onboard_camera", onboard, "camera", "--source", rest, "--rate", "10", *listen)
        self._keep("onboard_sound", onboard, *"sound --microphone test --speaker none".split(), *listen)

    def _start_up(self) -> subprocess.Popen:
        begin = time.monotonic()
        printed = self.folder / "printed" / "stack_up.log"
        with printed.open("a") as output:
            size = output.tell()
            up = self.on_pilot(
                str(ROOT / "stack"), "up", "--verbose", "both", "sim:=false", "gate:=robot", "sign_in:=false",
                "source:=test",
                f"nao_ip:={self.robot.address}", f"robotino_ip:={self.robot.address}", f"robotino_port:={REST_PORT}",
                f"roscore_ip:={self.pilot.address}", f"pepper_drive_server:={self.robot.address}",
                "front_frame_rate:=5",
                stdout=output, stderr=subprocess.STDOUT,
            )  # fmt: skip
        while "first picture" not in printed.read_text(errors="replace")[size:]:
            if up.poll() is not None or time.monotonic() - begin > STARTS:
                raise RuntimeError(f"the station does not start; see {printed}")
            time.sleep(0.2)
        self._note("station started", f"first picture after {time.monotonic() - begin:.1f} s")
        return up

    def _keep(self, name: str, *argv: str) -> None:
        with (self.folder / "printed" / f"{name}.log").open("a") as output:
            program = processes.start(
                self.robot.command(*argv),
                tied=True,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        self._kept[name] = ([*argv], program, time.monotonic())


def command(pid: int) -> list[str]:
    """Return the command line of a process; empty when it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").rstrip("\0").split("\0")
    except OSError:
        return []


def _end_quickly(program: subprocess.Popen) -> None:
    family = processes.descendants(program.pid)
    processes.end(program, patience=3.0)
    for pid in family:
        processes.send(pid, signal.SIGKILL)
