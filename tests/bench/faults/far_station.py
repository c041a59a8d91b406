"""A robot on one machine and its pilot's drivers on another, with a bad link between them.

On the robot's: the simulated robot, and what runs beside a real one. On the pilot's: master and drivers; no window and
no cameras, because hundreds of faults are to pass in half an hour. Where the robot truly is, is read on its own
machine, from a master of its own: no fault of the link touches that.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from telepresence.security.robot_key import RobotKey
from telepresence.station import processes
from telepresence.station.up import LAUNCH_TIMEOUTS

from .bad_link import BadLink
from .pilots import TopicPilot
from .station import PEPPER, ROBOTINO, Robot, Sayings, Truth
from .topics import TopicReader
from .trial import wait

ROOT = Path(__file__).resolve().parents[3]
NODES = ROOT / "catkin_ws" / "devel" / "lib"
DRIVE_SERVER = ROOT / "catkin_ws" / "src" / "naoqi_driver_py" / "robot" / "drive_server.py"
MASTER_PORT = 11311
UP_TIMEOUT = 60.0
DRIVE_PORT = 8085
_CLONE_NEWNET = 0x40000000  # linux/sched.h


class FarStation:
    """Until closed. Raises RuntimeError when it does not come up."""

    def __init__(self, name: str, folder: Path) -> None:
        self.robot: Robot = {"pepper": PEPPER, "robotino": ROBOTINO}[name]
        self._folder = folder
        self._running: list[subprocess.Popen] = []
        self.sayings = Sayings()
        self.link = BadLink()
        try:
            self._bring_up(name, folder)
        except BaseException:
            self.close()
            raise

    def _bring_up(self, name: str, folder: Path) -> None:
        key = folder / "robot.key"
        os.environ["XDG_CONFIG_HOME"] = str(folder)  # the pilot's store of keys
        RobotKey.make(key).store(self.link.robot.address)
        for machine in (self.link.pilot, self.link.robot):
            self._start(machine, sys.executable, "-m", "telepresence_ros.core", "-p", str(MASTER_PORT))
        self._robot_side(name, key)
        self._pilot_side(name)
        robot, pilot = self.link.robot, self.link.pilot
        self.kind, self.by = name, "topic"
        self.truth = Truth(_master(robot), self.robot.truth, entering(robot))
        self.truths = {name: self.truth}
        readers = {
            f"{self.robot.namespace}/safety": self.sayings.safety,
            f"{self.robot.namespace}/drive/state": self.sayings.lease,
            "/station/faults": self.sayings.fault,
        }
        self._readers = [TopicReader(_master(pilot), topic, use, entering(pilot)) for topic, use in readers.items()]
        self.pilot = TopicPilot(self._environment(pilot), self.robot.command, self.robot.speed, tuple(pilot.command()))
        self.restarter = TopicPilot(self._environment(robot), "/unused", 0.0, tuple(robot.command()))
        if not wait(lambda: self.truth.newest, UP_TIMEOUT):
            raise RuntimeError("the simulated robot did not come up:\n" + self.last_lines())

    def _robot_side(self, name: str, key: Path) -> None:
        robot = self.link.robot
        if name == "pepper":
            self._start(robot, NODES / "pepper_bringup/pepper_sim", "__name:=robot_control_node", "_address:=0.0.0.0",
                        "_port:=9559", "_scene:=flat", "_kinds/pepper/speaker:=none")  # fmt: skip
            self._start(robot, sys.executable, DRIVE_SERVER, "--qi-url", "tcp://127.0.0.1:9559", "--address",
                        robot.address, "--port", DRIVE_PORT, "--key", key)  # fmt: skip
            return
        self._start(robot, NODES / "rto_bringup/robotino_sim", "__name:=robot_control_node", "_port:=8080",
                    "_address:=0.0.0.0", "_scene:=flat")  # fmt: skip
        own = f"--address {robot.address} --key {key}".split()
        self._start(robot, NODES / "rto_bringup/robotino_onboard", "drive", "--robot", "127.0.0.1:8080", *own,
                    "--port", "8082")  # fmt: skip

    def _pilot_side(self, name: str) -> None:
        address = self.link.robot.address
        pilot = self.link.pilot
        if name == "pepper":
            naoqi = (f"--pip={address}", "--pport=9559", "__ns:=/pepper_robot")
            for sensor in ("laser", "sonar"):
                self._start(pilot, NODES / f"pepper_sensors_py/{sensor}.py", *naoqi, f"__name:=pepper_{sensor}")
            words = ["naoqi_driver_py", "naoqi_driver.launch", f"nao_ip:={address}",
                     f"drive_server:={address}:{DRIVE_PORT}"]  # fmt: skip
        else:
            words = ["rto_bringup", "rto.launch", f"hostname:={address}:8080", "gate:=robot", "camera:=false",
                     "sign_in:=false"]  # fmt: skip
        self._start(pilot, sys.executable, "-m", "telepresence_ros.roslaunch", "--wait", *LAUNCH_TIMEOUTS, *words)

    def _start(self, machine, *argv: object) -> None:
        log = self._folder / f"{len(self._running)}_{Path(str(argv[-1])).name[:20]}.log"
        with log.open("w") as output:
            self._running.append(
                processes.start(
                    machine.command(*map(str, argv)),
                    tied=True,
                    env=self._environment(machine),
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )
            )

    def _environment(self, machine) -> dict[str, str]:
        return {
            **os.environ,
            "ROS_MASTER_URI": _master(machine),
            "ROS_IP": machine.address,
            "ROS_HOME": str(self._folder / machine.address),
            "PYTHONUNBUFFERED": "1",
        }

    @property
    def running(self) -> bool:
        return all(process.poll() is None for process in self._running)

    def last_lines(self) -> str:
        lines = []
        for log in sorted(self._folder.glob("*.log")):
            lines += [f"{log.name}: {line}" for line in log.read_text(errors="replace").splitlines()[-4:]]
        return "\n".join(lines)

    def calm(self) -> None:
        """A link without faults."""
        self.link.delay, self.link.cut, self.link.stalled = 0.0, False, False

    def close(self) -> None:
        self.calm()
        for pilot in (getattr(self, "pilot", None), getattr(self, "restarter", None)):
            if pilot is not None:
                pilot.close()
        for reader in (*getattr(self, "_readers", ()), getattr(self, "truth", None)):
            if reader is not None:
                reader.close()
        for process in self._running:
            processes.send(process.pid, signal.SIGINT)
        for process in self._running:
            processes.end(process, patience=5.0)
        self.link.close()


def _master(machine) -> str:
    return f"http://{machine.address}:{MASTER_PORT}"


def entering(machine) -> Callable[[], None]:
    """Return what takes the thread that calls it to that machine: the sockets that it opens from then on are there."""

    def enter() -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        with open(machine.namespace) as namespace:
            if libc.setns(namespace.fileno(), _CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), "setns")

    return enter


def wait_ready(station: FarStation) -> None:
    """Until the robot drives. Raises RuntimeError."""
    deadline = time.monotonic() + UP_TIMEOUT
    while time.monotonic() < deadline:
        station.pilot.hold()
        if wait(lambda: (s := station.truth.newest) and s.speed > 0.5 * station.robot.speed, 3.0):
            station.pilot.release()
            return
        station.pilot.release()
    raise RuntimeError("the robot does not drive over the link:\n" + station.last_lines())
