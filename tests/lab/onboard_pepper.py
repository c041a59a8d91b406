"""What runs on a Pepper beside its NAOqi, in tests: the drive server as it is copied there, and an ALMotion that notes
what it is asked."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import qi

from telepresence.drive.link import DriveLink
from telepresence.security.robot_key import RobotKey


class Motion:
    """The part of ALMotion that drives, without physics: a motion or a stop ends when the test says so."""

    def __init__(self) -> None:
        self.calls: list[tuple] = []
        self.hangs = self.stands = False
        self._waiting: list[qi.Promise] = []

    def move(self, x: float, y: float, theta: float) -> qi.Future:
        self.calls.append(("move", round(x, 3), round(y, 3), round(theta, 3)))
        return self._later(not self.hangs)

    def moveTo(self, *arguments: object) -> qi.Future:
        self.calls.append(("moveTo", *arguments))
        return self._later(False)

    def stopMove(self) -> qi.Future:
        self.calls.append(("stopMove",))
        return self._later(self.stands)

    def killMove(self) -> None:
        self.calls.append(("killMove",))
        self.arrive(True)

    def moveIsActive(self) -> bool:
        return False

    def arrive(self, reached: bool) -> None:
        waiting, self._waiting = self._waiting, []
        for promise in waiting:
            promise.setValue(reached)

    def names(self) -> list[str]:
        """What was called, repetitions left out."""
        names = [call[0] for call in self.calls]
        return [name for name, before in zip(names, [None, *names], strict=False) if name != before]

    def _later(self, at_once: bool) -> qi.Future:
        promise = qi.Promise()
        if at_once:
            promise.setValue(True)
        else:
            self._waiting.append(promise)
        return promise.future()


class OnboardServer:
    """The program, started as on the robot, without the vendor's packages and ours: all that it needs is in its file.

    Args:
        folder: Where `make_drive_server.py` has put it.
        url: Of NAOqi.
    """

    def __init__(self, folder: Path, url: str, *options: str, **environment: str) -> None:
        program = [sys.executable, "-S", str(folder / "drive_server.py"), "--qi-url", url, "--port", "0", *options]
        self.process = subprocess.Popen(
            program, env={**os.environ, "PYTHONPATH": "", **environment}, stdout=subprocess.PIPE, text=True
        )
        said = next(line for line in self.process.stdout if "listens on udp" in line)
        self.port = int(said.rpartition(":")[2])

    def link(self, key: RobotKey | None) -> DriveLink:
        return DriveLink(f"127.0.0.1:{self.port}", key)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(10)
        self.process.stdout.close()

    def end(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(10)
        self.process.stdout.close()
        return status


def drive(pilot: DriveLink, motion: Motion, wait_until: Callable, name: str = "move") -> None:
    """Drive until ALMotion has got a velocity, or what is called instead."""

    def driven() -> bool:
        pilot.drive(0.2, 0.0, 0.1)
        return motion.calls[-1:] != [] and motion.calls[-1][0] == name

    wait_until(driven, "the robot drives")


def children(pid: int) -> list[int]:
    """Processes that the first thread of a process has started."""
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def connections(port: int) -> int:
    """How many clients have a connection to a port of this machine, by /proc/net/tcp."""
    lines = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return sum(line.split()[2].endswith(f":{port:04X}") and line.split()[3] == "01" for line in lines)
