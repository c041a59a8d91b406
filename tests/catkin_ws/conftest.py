"""Fixtures of the ROS packages' tests: a small NAOqi in this process and a wire to it that can be frozen and cut; a ROS
graph of its own with the simulated robot, real nodes, and a probe that watches and drives."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import xmlrpc.client
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import forked_programs
import pytest
from endings import end_together
from free_ports import free_port
from naoqi_clients import DEFAULT, client_library
from talker import PROBE, Caller
from waiting import wait_until

from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.server import Server
from telepresence.station import processes
from telepresence.station.ros_master import master_answers

qi = client_library(DEFAULT)
ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 40.0
"""Seconds after which something counts as never coming; generous, because the machines are shared."""


class Naoqi:
    """A qi service directory on a free port with the services a test registers."""

    def __init__(self) -> None:
        self._behind: list[Any] = []
        self.session = qi.Session()
        self.session.listenStandalone("tcp://127.0.0.1:0")
        self.port = int(self.session.endpoints()[0].rpartition(":")[2])

    def register(self, name: str, service: object) -> None:
        """Add a service: a Python object, or one of the simulated robot's, which stay behind a server of ours."""
        if isinstance(service, ServedObject):
            server = Server("tcp://127.0.0.1:0")
            server.register(name, service)
            server.start()
            way = qi.Session()
            way.connect(server.endpoints[0])
            service = way.service(name)
            self._behind += [way, server]
        self.session.registerService(name, service)

    def close(self) -> None:
        self.session.close()
        for part in self._behind:
            part.close()


class RobotConnection:
    """A TCP relay to `target`: `freeze()` stops the bytes but not the connections, `cut()` ends these, `thaw()` goes
    on."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._flowing = threading.Event()
        self._flowing.set()
        self._sockets: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, name="wire", daemon=True).start()

    def freeze(self) -> None:
        self._flowing.clear()

    def thaw(self) -> None:
        self._flowing.set()

    def cut(self) -> None:
        for end in self._sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()

    def close(self) -> None:
        self._listener.close()
        self.cut()
        self._flowing.set()

    def _accept(self) -> None:
        while True:
            try:
                near, _ = self._listener.accept()
                far = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                return
            self._sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._pump, args=(source, sink), daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                self._flowing.wait()
                sink.sendall(data)
        with contextlib.suppress(OSError):
            sink.shutdown(socket.SHUT_RDWR)


@pytest.fixture
def naoqi() -> Iterator[Naoqi]:
    server = Naoqi()
    yield server
    server.close()


@pytest.fixture
def make_connection() -> Iterator[Callable[[int], RobotConnection]]:
    wires: list[RobotConnection] = []

    def make(target: int) -> RobotConnection:
        wires.append(RobotConnection(target))
        return wires[-1]

    yield make
    for wire in wires:
        wire.close()


class Program:
    """A running program and what it has printed; `with` it, it is dead at the end, however that comes."""

    def __init__(self, argv: list[str], environment: dict[str, str], log: Path) -> None:
        self._log = log
        with log.open("w") as output:
            self.process = forked_programs.start(
                argv, env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
            )

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_exception: object) -> None:
        self.kill()

    @property
    def output(self) -> str:
        return self._log.read_text(errors="replace")

    def wait_for(self, pattern: str) -> re.Match:
        """Wait until the output matches."""

        def match() -> re.Match | None:
            if self.process.poll() is not None:
                pytest.fail(f"{self._log.stem} ended with {self.process.returncode}:\n{self.output}")
            return re.search(pattern, self.output)

        try:
            return wait_until(match, f"{self._log.stem} prints {pattern!r}")
        except AssertionError as error:
            if self.process.poll() is None:
                pytest.fail(f"{error}; so far:\n{self.output}")
            raise

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def end(self) -> int:
        return processes.end(self.process, patience=10.0)


class Probe(Caller):
    """A node in a process of its own that watches topics, drives and calls services; see ros_probe.py.

    Args:
        remappings: As for any node, e.g. "/cmd_vel:=/rto3/safe_cmd_vel".
    """

    def __init__(self, environment: dict[str, str], *remappings: str) -> None:
        super().__init__(environment, PROBE, *remappings)

    def latest(self, topic: str) -> list[Any]:
        """The fields of the next message on a watched topic."""
        self.forget(topic)
        return wait_until(lambda: self.seen(topic), f"a message on {topic}")[-1][1]

    def newest(self, topic: str) -> list[Any]:
        """The fields of the newest message on a watched topic; of the next one, when there was none yet."""
        return wait_until(lambda: self.seen(topic), f"a message on {topic}")[-1][1]


class Graph:
    """A private ROS graph: master, simulated robot, nodes."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.workspace = ROOT / "catkin_ws" / "devel"
        self.robot_port = free_port()
        self.uri = f"http://127.0.0.1:{free_port()}"
        self.environment = {
            **read_environment(),
            "ROS_MASTER_URI": self.uri,
            "ROS_HOME": str(folder / "ros"),
            "ROS_IP": "127.0.0.1",
            "DRIVE_PORT": str(free_port()),
        }
        self.programs: list[Program] = []
        self._probes: list[Probe] = []
        self.master = self.start_master()

    def free_port(self) -> int:
        return free_port()

    def start_master(self) -> Program:
        self.master = self.run("rosmaster", "--core", "-p", self.uri.rpartition(":")[2])
        wait_until(lambda: master_answers(self.uri), "the ROS master answers")
        return self.master

    def start_robot(self, scene: str = "empty", *options: str) -> Program:
        """The simulated Pepper, on the same port every time."""
        port = str(self.robot_port)
        robot = self.run(sys.executable, "-m", "pepper_sim", "--port", port, "--scene", scene, *options)
        robot.wait_for("listening on")
        return robot

    def run_node(self, package: str, program: str, *arguments: str) -> Program:
        """Start a node of the workspace with the robot's address."""
        return self.run(
            str(self.workspace / "lib" / package / program), "--pip=127.0.0.1", f"--pport={self.robot_port}", *arguments
        )

    def start_drive_server(self) -> Program:
        """What moves the simulated Pepper, on the same port every time: see `drive_server`."""
        program = self.workspace / "lib" / "naoqi_driver_py" / "drive_server.py"
        port = self.environment["DRIVE_PORT"]
        return self.run(str(program), f"--qi-url=tcp://127.0.0.1:{self.robot_port}", f"--port={port}")

    @property
    def drive_server(self) -> str:
        """Its address, as an argument of a node."""
        return f"_drive_server:=127.0.0.1:{self.environment['DRIVE_PORT']}"

    def run(self, *argv: str) -> Program:
        log = self._folder / f"{len(self.programs)}_{Path(argv[0]).name}.log"
        self.programs.append(Program(list(argv), self.environment, log))
        return self.programs[-1]

    def probe(self, *remappings: str) -> Probe:
        self._probes.append(Probe(self.environment, *remappings))
        return self._probes[-1]

    def forget_parameters(self, node: str) -> None:
        """Delete what earlier tests gave a node of this name: `_name:=value` outlives the node."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            master.deleteParam("/tests", node)

    def close(self) -> None:
        for probe in self._probes:
            probe.close()
        end_together([program.process for program in self.programs])


_environment: dict[str, str] = {}


def read_environment() -> dict[str, str]:
    """The environment after `. ./env.sh`, wherever the tests were started."""
    if not _environment:
        words = subprocess.run(
            ["bash", "-c", '. "$0"/env.sh && env -0', str(ROOT)], check=True, capture_output=True, text=True
        ).stdout
        _environment.update(word.split("=", 1) for word in words.split("\0") if "=" in word)
    return {**os.environ, **_environment}


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Graph]:
    made = Graph(tmp_path_factory.mktemp("ros"))
    yield made
    made.close()


@pytest.fixture(scope="session")
def workspace_environment() -> dict[str, str]:
    """The environment in which the workspace's packages are found."""
    return read_environment()


@pytest.fixture(scope="session")
def roslaunch_says(workspace_environment: dict[str, str]) -> Callable[..., str]:
    """What `roslaunch` says it would do: `roslaunch_says("--nodes", "rto_bringup", "rto.launch", "laser:=true")`."""

    def ask(*words: str, **environment: str) -> str:
        together = {**workspace_environment, **environment}
        done = subprocess.run(["roslaunch", *words], env=together, capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return ask
