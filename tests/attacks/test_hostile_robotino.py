"""A Robotino that was taken over, or whoever answers at its address, against the programs that ask it.

`rto_node` and `rto_laserrangefinder_node` run; their robot is a socket that answers as each attack has it. An attack
has failed when both still ask afterwards, have asked nobody else, and wrote a few short printable lines.
"""

from __future__ import annotations

import gzip
import socket
import time
from collections.abc import Callable, Iterator

import pytest
from bare_nodes import BareNodes
from tcp_listener import TcpListener
from waiting import wait_until

HONEST = {
    "/data/distancesensorarray": b"[0.41,0.41,0.41,0.41,0.41,0.41,0.41,0.41,0.41]",
    "/data/bumper": b'{"value":false}',
    "/data/odometry": b"[0,0,0,0,0,0,1]",
    "/data/analoginputarray": b"[0,0,0,0,0,0,0,0]",
    "/data/digitalinputarray": b"[false,false,false,false,false,false,false,false]",
    "/data/digitaloutputstatus": b"[false,false,false,false,false,false,false,false]",
    "/data/powermanagement": b'{"voltage":24.0,"batteryType":"NiMH","batteryLow":false,"ext_power":false}',
    "/data/scan0": b'{"seq":1,"angle_min":-1,"angle_increment":0.1,"time_increment":0,"scan_time":0.1,'
    b'"range_min":0.1,"range_max":5,"ranges":[1,1,1]}',
}
LINES_ALLOWED = 4
"""Lines that each node may print about an attack, besides one a second."""


def http(body: bytes, status: str = "200 OK", head: str = "") -> bytes:
    return f"HTTP/1.1 {status}\r\n{head}Content-Length: {len(body)}\r\n\r\n".encode() + body


class HostileRobotino:
    """Answers honestly, or every question with `answer`; `drip` sends that byte by byte and never ends."""

    def __init__(self) -> None:
        self.answer: bytes | None = None
        self.drip = False
        self.asked = {"scan0": 0, "rest": 0}
        self.velocities: list[bytes] = []
        self._listener = TcpListener(self._talk)
        self.address = f"127.0.0.1:{self._listener.port}"

    def close(self) -> None:
        self._listener.close()

    def _talk(self, near: socket.socket) -> None:
        while request := near.recv(65536):
            path = request.split(b" ", 2)[1].decode(errors="replace")
            answer, drip = self.answer, self.drip
            if b"omnidrive" in request:
                self.velocities.append(request)
            if drip:
                near.sendall(b"HTTP/1.1 200 OK\r\nX: ")
                self._count(path)
                while self.drip:
                    near.sendall(b"y")
                    time.sleep(0.1)
                return
            near.sendall(http(HONEST.get(path, b"{}")) if answer is None else answer)
            self._count(path)
            if answer is not None and b"Content-Length" not in answer[:200]:
                near.shutdown(socket.SHUT_WR)
                return

    def _count(self, path: str) -> None:
        self.asked["scan0" if path.endswith("scan0") else "rest"] += 1


class Trap:
    """Somebody inside the pilot's network who should not be asked by the pilot's computer."""

    def __init__(self) -> None:
        self.calls = 0
        self._listener = TcpListener(self._count)
        self.address = f"127.0.0.1:{self._listener.port}"

    def close(self) -> None:
        self._listener.close()

    def _count(self, _near: socket.socket) -> None:
        self.calls += 1


class Scene:
    """The robot, the trap, and the nodes between them."""

    def __init__(self, nodes: BareNodes, robot: HostileRobotino, trap: Trap) -> None:
        self.robot, self.trap = robot, trap
        self._programs = {
            "rest": nodes.node("rto_node", "rto_node", f"_hostname:={robot.address}"),
            "scan0": nodes.node("rto_node", "rto_laserrangefinder_node", f"_hostname:={robot.address}"),
        }
        self.honest()

    def honest(self) -> None:
        """Let the robot answer as it should until everybody has asked it."""
        self.robot.answer, self.robot.drip = None, False
        for program in self._programs.values():
            program.ensure()
        self.wait_asked(3)

    def wait_asked(self, more: int) -> None:
        before = dict(self.robot.asked)

        def asked() -> bool:
            return all(
                self.robot.asked[name] >= before[name] + more or not self._programs[name].alive for name in before
            )

        wait_until(asked, "the nodes ask the robot")

    def attack(self, answer: bytes | None, drip: bool = False) -> None:
        self.honest()
        begun = time.monotonic()
        before = {name: len(program.output) for name, program in self._programs.items()}
        calls, velocities = self.trap.calls, len(self.robot.velocities)
        self.robot.answer, self.robot.drip = answer, drip
        self.wait_asked(2)
        self.robot.answer, self.robot.drip = None, False
        self.wait_asked(3)
        for name, program in self._programs.items():
            said = program.output[before[name] :]
            assert program.alive, f"it ended:\n{said[-2000:]}"
            lines = [line for line in said.splitlines() if line]
            assert len(lines) <= LINES_ALLOWED + time.monotonic() - begun, said[-2000:]
            assert all(len(line) < 600 and line.isprintable() for line in lines), said[-2000:]
        assert self.trap.calls == calls, "somebody else was asked"
        assert len(self.robot.velocities) == velocities, "the robot was driven"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    robot, trap = HostileRobotino(), Trap()
    nodes = BareNodes(tmp_path_factory.mktemp("robotino"), http_proxy=f"http://{trap.address}")
    try:
        yield Scene(nodes, robot, trap)
    finally:
        nodes.close()
        robot.close()
        trap.close()


CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
ANSWERS: dict[str, bytes] = {
    "a status line of 26 digits": b"HTTP/1.1 99999999999999999999999999 OK\r\n\r\n",
    "control characters for a status": b"HTTP/1.1 \x1b[2J\x07 \x1b]0;owned\x07\r\n\r\n",
    "5000 headers": b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 5000 + b"\r\n",
    "200 megabytes announced": b"HTTP/1.1 200 OK\r\nContent-Length: 200000000\r\n\r\n" + b" " * 1_000_000,
    "a length of 5000 digits": b"HTTP/1.1 200 OK\r\nContent-Length: " + b"9" * 5000 + b"\r\n\r\n{}",
    "a chunk of negative size": CHUNKED + b"-5\r\n[]\r\n0\r\n\r\n",
    "trailers without end": CHUNKED + b"0\r\n" + b"X: y\r\n" * 100_000,
    "100 Continue again and again": b"HTTP/1.1 100 Continue\r\n\r\n" * 20_000,
    "a gzip bomb": http(gzip.compress(b" " * 10_000_000), head="Content-Encoding: gzip\r\n"),
    "a number of 400 digits": http(b"[" + b",".join([b"9" * 400] * 9) + b"]"),
    "a number of 5000 digits": http(b'{"value":' + b"9" * 5000 + b"}"),
    "numbers that no float32 holds": http(b"[" + b",".join([b"1e300"] * 9) + b"]"),
    "a scan that no float32 holds": http(
        b'{"seq":1,"angle_min":1e300,"angle_increment":1,"time_increment":0,"scan_time":1,"range_min":0,'
        b'"range_max":5,"ranges":[1e300]}'
    ),
    "NaN and infinity": http(b"[NaN,Infinity,-Infinity,NaN,NaN,NaN,NaN,NaN,NaN]"),
    "JSON 100,000 deep": http(b"[" * 100_000 + b"]" * 100_000),
    "objects 30,000 deep": http(b'{"value":' * 30_000 + b"1" + b"}" * 30_000),
    "a scan whose count is a list": http(b'{"seq":[1],"ranges":[1],"angle_min":null}'),
    "a scan whose count is no number": http(HONEST["/data/scan0"].replace(b'"seq":1', b'"seq":1e400')),
    "a member twice": http(b'{"value":false,"value":"\\ud800","seq":1,"seq":2}'),
    "invalid UTF-8 with control characters": http(b"\xff\xfe\x1b[2J\x1b]0;owned\x07" * 50),
    "an error page with control characters": http(b"\x1b[2J\x1b[31m\r\n" * 1000, "500 \x1b[2J"),
    "a megabyte of brackets": http(b'["' + b"\\u001b[2J" * 100_000 + b'"]'),
}


@pytest.mark.parametrize("answer", ANSWERS.values(), ids=[name.replace(" ", "_") for name in ANSWERS])
def test_an_answer_ends_a_node(answer: bytes, scene: Scene) -> None:
    """Nobody ends, floods the log, or writes what a terminal obeys."""
    scene.attack(answer)


def test_an_answer_that_drips_holds_the_nodes_for_ever(scene: Scene) -> None:
    """A byte every 0.1 s: each question ends within its time all the same."""
    scene.attack(None, drip=True)


@pytest.mark.parametrize("target", ["http://{trap}/", "//{trap}/x", "file:///etc/passwd"])
def test_a_redirect_makes_the_pilots_computer_ask_another_address(target: str, scene: Scene) -> None:
    """No redirect is followed, and no proxy of the environment asked."""
    scene.attack(http(b"", "302 Found", f"Location: {target.format(trap=scene.trap.address)}\r\n"))


@pytest.fixture
def ask_doctor(tmp_path: object) -> Callable[[str], tuple[int, str]]:
    import subprocess

    from bare_nodes import ROOT

    def ask(address: str) -> tuple[int, str]:
        code = (
            "import sys; sys.path.insert(0, sys.argv[1]); from telepresence.station import doctor;"
            "host, port = sys.argv[2].split(':'); doctor.WEB_PORTS = (int(port),);"
            "doctor.ROUND_TRIPS = 1; sys.exit(0 if doctor.report(lambda: doctor.robot(sys.argv[2])) else 1)"
        )
        ended = subprocess.run(
            ["/usr/bin/python3", "-c", code, str(ROOT), address], capture_output=True, text=True, timeout=60
        )
        return ended.returncode, ended.stdout + ended.stderr

    return ask


def test_the_doctor_follows_a_redirect(ask_doctor: Callable, scene: Scene) -> None:
    """`./stack doctor ROBOT` asks the robot, and nobody whom the robot names."""
    calls = scene.trap.calls
    scene.robot.answer = http(b"", "302 Found", f"Location: http://{scene.trap.address}/\r\n")
    try:
        ask_doctor(scene.robot.address)
    finally:
        scene.honest()
    assert scene.trap.calls == calls


@pytest.mark.parametrize(
    "head",
    ["Date: \x1b[2J\x1b]0;owned\x07", "Date: Mon, 99 Xyz 99999 99:99:99 GMT", "Date: " + "9" * 5000],
    ids=["control_characters", "no_date", "a_year_of_5000_digits"],
)
def test_the_doctor_falls_over_a_date(head: str, ask_doctor: Callable, scene: Scene) -> None:
    """It says what is wrong in printable lines, without a traceback."""
    scene.robot.answer = http(b"", head=f"{head}\r\n")
    try:
        _, said = ask_doctor(scene.robot.address)
    finally:
        scene.honest()
    assert "Traceback" not in said and all(line.isprintable() for line in said.splitlines()), said
