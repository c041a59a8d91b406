"""A robot whose drive server is attacked, its pilots, and the strangers.

Some strangers have sockets of their own; `Middle` sits between pilot and robot, sees every datagram, and sends what it
likes from either one's address.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from robotino_sim.simulation import Simulation
from telepresence.drive import session as drive_session
from telepresence.drive.datagram import encode
from telepresence.drive.link import DriveLink
from telepresence.security.robot_key import RobotKey
from telepresence.station import processes

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "stack").exists())
SOURCES = ("rto_bringup", "rto_node", "naoqi_driver_py")
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": ":".join(map(str, (ROOT, *(ROOT / "catkin_ws" / "src" / name / "src" for name in SOURCES)))),
}
HOST = "127.0.0.1"
STYLES = ("by JSON", "without a key", "with a guessed key")
"""What strangers try to speak; before there were keys everything was JSON."""


class Stranger:
    """Somebody in the network, without the robot's key."""

    def __init__(self, port: int, style: str, source: str = HOST) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((source, 0))
        self._socket.connect((HOST, port))
        self._style, self._token, self._number, self._session = style, "", 0, None
        self.echo, self.sent, self.received = time.monotonic(), 0, 0

    def close(self) -> None:
        self._socket.close()

    def send(self, datagram: bytes) -> None:
        self.sent += len(datagram)
        with contextlib.suppress(ConnectionError):
            self._socket.send(datagram)

    def listen(self, seconds: float) -> Iterator[bytes]:
        end = time.monotonic() + seconds
        while select.select([self._socket], [], [], max(0.0, end - time.monotonic()))[0]:
            with contextlib.suppress(ConnectionError):
                datagram = self._socket.recv(2000)
                self.received += len(datagram)
                yield datagram

    def enter(self, patient: bool = True) -> Stranger:
        """Do everything that a pilot does to get a session."""
        if self._style == "by JSON":
            end = time.monotonic() + (3.0 if patient else 0.0)
            while not self._token:
                self.send(json.dumps({"type": "hello"}).encode())
                answer = next(self.listen(0.2), b"")
                with contextlib.suppress(ValueError):
                    self._token = json.loads(answer).get("session", "")
                if not answer or time.monotonic() > end:
                    break
            return self
        key = RobotKey(os.urandom(32)) if self._style == "with a guessed key" else None
        own = bytes.fromhex(key.fingerprint) if key else drive_session.NO_KEY
        handshake = drive_session.PilotHandshake(key, "pilot", 9)
        self.send(handshake.hello)
        challenge = next(self.listen(10.0))
        assert handshake.take(challenge[: -len(own)] + own), "the robot challenges whoever says hello"
        self._session = handshake.session
        self.send(handshake.open)
        return self

    def say(self, **fields: object) -> None:
        self._number += 1
        if self._session is None:
            self.send(json.dumps({**fields, "session": self._token, "seq": self._number}).encode())
        else:
            self.send(self._session.seal(encode(**fields)))

    def drive(self, velocity: list[float], seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.say(type="drive", echo=self.echo, after=0.0, velocity=velocity, careful=False)
            for datagram in self.listen(0.05):
                with contextlib.suppress(ValueError):
                    self.echo = json.loads(datagram).get("stamp", self.echo)


class Middle:
    """Between pilot and robot: hands on what both send, as far as `change` lets it through, and keeps a copy."""

    def __init__(self, robot: int) -> None:
        self._near, self._far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for each in (self._near, self._far):
            each.bind((HOST, 0))
        self._far.connect((HOST, robot))
        self.port = self._near.getsockname()[1]
        self.change: Callable[[str, bytes], bytes | None] = lambda _to, datagram: datagram
        self.seen: dict[str, list[bytes]] = {"robot": [], "pilot": []}
        self._pilot: tuple[str, int] | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._relay, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._closed.set()
        self._thread.join()
        self._near.close()
        self._far.close()

    def send(self, to: str, datagram: bytes) -> None:
        with contextlib.suppress(ConnectionError):
            if to == "robot":
                self._far.send(datagram)
            elif self._pilot:
                self._near.sendto(datagram, self._pilot)

    def _relay(self) -> None:
        while not self._closed.is_set():
            for source in select.select([self._near, self._far], [], [], 0.1)[0]:
                with contextlib.suppress(ConnectionError):
                    datagram, writer = source.recvfrom(2000)
                    to = "robot" if source is self._near else "pilot"
                    if to == "robot":
                        self._pilot = writer
                    self.seen[to].append(datagram)
                    changed = self.change(to, datagram)
                    if changed is not None:
                        self.send(to, changed)


class Robot:
    """The drive server before a simulated robot, and a pilot beside it who only watches."""

    def __init__(self, folder: Path) -> None:
        self.simulation = Simulation("empty", port=0)
        self.simulation.__enter__()
        self.key = folder / "robot.key"
        RobotKey.make(self.key).store(HOST)
        self.log = folder / "drive.log"
        self.process = start_drive_server(self.log, "--robot", self.simulation.url, "--key", str(self.key))
        self.port = port_of(self.process)
        self.watcher = self.pilot()

    def pilot(self, port: int = 0, **who: object) -> DriveLink:
        link = DriveLink(f"{HOST}:{port or self.port}", **who)
        wait(lambda: not link.problem, f"the drive server answers: {link.problem}")
        return link

    def close(self) -> None:
        self.watcher.close()
        processes.end(self.process, patience=10.0)
        self.process.stdout.close()
        self.simulation.__exit__(None, None, None)

    @property
    def state(self) -> str:
        return self.watcher.report()[0].state

    @property
    def given(self) -> tuple[float, ...]:
        return self.watcher.report()[0].given

    def let_reports_pass(self, count: int = 4) -> None:
        seq = self.watcher.report()[0].seq
        wait(lambda: self.watcher.report()[0].seq >= seq + count, "reports go on")

    def free(self) -> None:
        """Nobody drives, nothing is stopped."""
        self.watcher.ask("reset stop")
        wait(lambda: self.state == "no command" and "Another" not in self.watcher.report()[0].reason, "nobody drives")


def start_drive_server(log: Path, *options: str) -> subprocess.Popen:
    with log.open("w") as errors:
        return processes.start(
            [sys.executable, "-m", "rto_bringup.onboard", "drive", "--port", "0", *options],
            env=ENVIRONMENT,
            stdout=subprocess.PIPE, stderr=errors, text=True,
        )  # fmt: skip


def port_of(process: subprocess.Popen) -> int:
    announcement = process.stdout.readline()
    assert "listens on" in announcement, f"{process.args}: {announcement!r}"
    return int(announcement.rpartition(":")[2])


def wait(condition: Callable[[], object], what: str, timeout: float = 30.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.01)


@contextlib.contextmanager
def holding(link: DriveLink, *velocity: float) -> Iterator[None]:
    """The pilot holds a key."""
    let_go = threading.Event()

    def hold() -> None:
        while not let_go.wait(0.05):
            link.drive(*velocity)

    thread = threading.Thread(target=hold, daemon=True)
    thread.start()
    try:
        yield
    finally:
        let_go.set()
        thread.join()
        link.release()


def standing(robot: Robot) -> bool:
    return robot.given == (0.0, 0.0, 0.0)


class Motion:
    """Pepper's ALMotion, which notes what moves the robot."""

    def __init__(self) -> None:
        self.moves: list[tuple] = []

    def move(self, *velocity: float) -> None:
        self.moves.append(velocity)

    def moveTo(self, *pose: float) -> bool:
        self.moves.append(pose)
        return True

    def stopMove(self) -> bool:
        return True

    def killMove(self) -> None:
        pass

    def moveIsActive(self) -> bool:
        return False
