"""A simulated Robotino, the programs that run on it, and a network to them that can be cut."""

from __future__ import annotations

import contextlib
import http.client
import re
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from robotino_sim.simulation import Simulation
from telepresence.station import processes

ROOT = Path(__file__).resolve().parents[4]
SOURCES = [ROOT, *(ROOT / "catkin_ws" / "src" / name / "src" for name in ("rto_bringup", "rto_node"))]


class Network:
    """Everything between pilot and robot: `cut()` lets no packet through either way, `join()` does again.

    Datagrams are dropped, and requests that come meanwhile get no answer, as if their packets were lost.
    """

    def __init__(self) -> None:
        self.whole = threading.Event()
        self.whole.set()
        self.dropped = 0
        self._closed = threading.Event()
        self._sockets: list[socket.socket] = []
        self._servers: list[ThreadingHTTPServer] = []

    def cut(self) -> None:
        self.whole.clear()

    def join(self) -> None:
        self.whole.set()

    def close(self) -> None:
        self._closed.set()
        self.whole.set()
        for server in self._servers:
            server.shutdown()
            server.server_close()
        for each in self._sockets:
            each.close()

    def datagrams_to(self, port: int) -> int:
        """A port whose datagrams reach `port`, with the answers to whoever wrote last."""
        near, far = self._socket(), self._socket()
        far.connect(("127.0.0.1", port))
        threading.Thread(target=self._relay, args=(near, far, None), daemon=True).start()
        return near.getsockname()[1]

    def datagrams_between(self, left: int, right: int) -> tuple[int, int]:
        """Ports that stand for `right` before `left`, and for `left` before `right`."""
        near, far = self._socket(), self._socket()
        threading.Thread(target=self._relay, args=(near, far, (left, right)), daemon=True).start()
        return near.getsockname()[1], far.getsockname()[1]

    def signaling_to(self, port: int) -> int:
        """A port whose requests reach a camera sender; media go through this network too, for offers and answers are
        rewritten on their way."""
        network = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                offer = self.rfile.read(int(self.headers["Content-Length"])).decode()
                receiver = media_port(offer)
                standing_in = network.datagrams_between(receiver, 0)
                answer = self.forward("POST", with_port(offer, receiver, standing_in[1]).encode())
                if answer is None:
                    return
                status, headers, body = answer
                if status == 201:
                    sender = media_port(body.decode())
                    network.aim(standing_in[1], sender)
                    body = with_port(body.decode(), sender, standing_in[0]).encode()
                self.reply(status, headers, body)

            def do_DELETE(self) -> None:
                answer = self.forward("DELETE", None)
                if answer is not None:
                    self.reply(*answer)

            def forward(self, method: str, body: bytes | None) -> tuple[int, dict[str, str], bytes] | None:
                if not network.whole.is_set():
                    network.whole.wait()
                    self.close_connection = True
                    return None
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
                try:
                    connection.request(method, self.path, body, {"Content-Type": self.headers.get("Content-Type", "")})
                    response = connection.getresponse()
                    return response.status, dict(response.headers), response.read()
                except OSError:
                    self.close_connection = True
                    return None
                finally:
                    connection.close()

            def reply(self, status: int, headers: dict[str, str], body: bytes) -> None:
                with contextlib.suppress(OSError):
                    self.send_response(status)
                    for name in ("Content-Type", "Location"):
                        if name in headers:
                            self.send_header(name, headers[name])
                    self.send_header("Content-Length", str(len(body)))
                    self.end_headers()
                    self.wfile.write(body)

            def log_message(self, *_: object) -> None:
                pass

        server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        server.daemon_threads = True
        self._servers.append(server)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        return server.server_address[1]

    def aim(self, port: int, target: int) -> None:
        """The stand-in at `port` learns whom its datagrams are for."""
        self._targets[port] = target

    _targets: dict[int, int]

    def _socket(self) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.bind(("127.0.0.1", 0))
        self._sockets.append(made)
        return made

    def _relay(self, near: socket.socket, far: socket.socket, ports: tuple[int, int] | None) -> None:
        back = ("127.0.0.1", ports[0]) if ports else None
        with contextlib.suppress(OSError, ValueError):
            while not self._closed.is_set():
                for source in select.select([near, far], [], [], 0.2)[0]:
                    try:
                        data, writer = source.recvfrom(65536)
                    except ConnectionError:
                        continue
                    if source is near and ports is None:
                        back = writer
                    if not self.whole.is_set():
                        self.dropped += 1
                        continue
                    with contextlib.suppress(ConnectionError):
                        if source is far:
                            near.sendto(data, back)
                        elif ports is None:
                            far.send(data)
                        elif target := self._targets.get(far.getsockname()[1]):
                            far.sendto(data, ("127.0.0.1", target))


def media_port(sdp: str) -> int:
    return int(re.search(r"^a=candidate:\S+ 1 udp \d+ 127\.0\.0\.1 (\d+) typ host", sdp, re.M).group(1))


def with_port(sdp: str, old: int, new: int) -> str:
    return re.sub(rf"\b{old}\b", str(new), sdp)


@pytest.fixture
def network() -> Iterator[Network]:
    made = Network()
    made._targets = {}
    yield made
    made.close()


@pytest.fixture(scope="module")
def simulation() -> Iterator[Simulation]:
    """A Robotino in an empty place, in real time."""
    with Simulation("empty", port=0) as running:
        yield running


class Program:
    """One of the programs that run on the robot, in a process of its own, once it listens."""

    def __init__(self, process: subprocess.Popen) -> None:
        self.process = process
        announcement = process.stdout.readline()
        assert "listens on" in announcement, f"{process.args}: {announcement!r}"
        self.port = int(announcement.rpartition(":")[2])

    def end(self) -> int:
        return processes.end(self.process, patience=10.0)


@pytest.fixture(scope="module")
def start_onboard(workspace_environment: dict[str, str]) -> Iterator[Callable[..., subprocess.Popen]]:
    """Start one of the programs with pipes for its input and output."""
    started: list[subprocess.Popen] = []

    def start(*arguments: str, **environment: str) -> subprocess.Popen:
        process = processes.start(
            [sys.executable, "-m", "rto_bringup.onboard", *arguments],
            env={**workspace_environment, **environment, "PYTHONPATH": ":".join(map(str, SOURCES))},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        processes.end(process, patience=10.0)
        process.stdin.close()
        process.stdout.close()


@pytest.fixture(scope="module")
def run_onboard(start_onboard: Callable[..., subprocess.Popen]) -> Callable[..., Program]:
    """Start one of the servers and wait until it listens."""
    return lambda *arguments, **environment: Program(start_onboard(*arguments, **environment))


@pytest.fixture(scope="module")
def drive_server(simulation: Simulation, run_onboard: Callable[..., Program]) -> Program:
    return run_onboard("drive", "--port", "0", "--robot", simulation.url)


class Driving:
    """A pilot who holds the same velocity, ten times a second."""

    def __init__(self, link, velocity: tuple[float, float, float]) -> None:
        self._link, self._velocity = link, velocity
        self._let_go = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._let_go.is_set():
            self._link.drive(*self._velocity)
            self._let_go.wait(0.1)

    def let_go(self) -> None:
        self._let_go.set()
        self._thread.join()
        self._link.release()


@pytest.fixture
def hold() -> Iterator[Callable[..., Driving]]:
    held: list[Driving] = []

    def start(link, *velocity: float) -> Driving:
        held.append(Driving(link, velocity))
        return held[-1]

    yield start
    for each in held:
        each.let_go()


def positions(simulation: Simulation, seconds: float) -> list[tuple[float, float, float]]:
    """(time since now [s], x, y [m]) of the robot, a hundred times a second."""
    begin, found = time.monotonic(), []
    while (now := time.monotonic() - begin) < seconds:
        found.append((now, *simulation.robot.truth()[:2]))
        time.sleep(0.01)
    return found


@pytest.fixture(scope="session")
def watch_robot() -> Callable:
    return positions
