"""A Pepper that was taken over, or whoever answers in its place, against the programs that speak NAOqi.

The vendor's `qi` plays the robot; the drivers of base, joints and condition run, and `rob_cam.py`, which
fetches its pictures. An attack has failed when all of them still ask afterwards, the robot was not driven, and each
wrote a few short printable lines. The attacks on the password put a socket between a driver and NAOqi.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import qi
from bare_nodes import BareNode, BareNodes
from free_ports import free_port
from tls_front import TlsFront, make_certificate
from waiting import wait_until

SECRET = "correct horse battery staple"
LINES_ALLOWED = 8
"""Lines that each program may print about an attack, besides one a second."""
WIDTH, HEIGHT = 640, 480
HONEST = object()
"""What a lie answers where it does not lie."""


class HostilePepper:
    """Answers as NAOqi does, or every question with what `lie` makes."""

    def __init__(self) -> None:
        self.lie: Callable[[str], Any] | None = None
        self.asked: dict[str, int] = {}
        self.velocities: list[tuple] = []
        self._lock = threading.Lock()
        self.session = qi.Session()
        self.session.listenStandalone("tcp://127.0.0.1:0")
        self.port = int(self.session.endpoints()[0].rpartition(":")[2])
        for service in (Memory, Motion, Sonar):
            self.session.registerService(f"AL{service.__name__}", service(self))
        self.session.registerService("ALVideoDevice", Video(self))

    def reply(self, method: str, honest: Any, key: str = "") -> Any:
        with self._lock:
            name = f"{method} {key}".strip()
            self.asked[name] = self.asked.get(name, 0) + 1
        answer = HONEST if self.lie is None else self.lie(method)
        return honest if answer is HONEST else answer

    def close(self) -> None:
        self.session.close()


class Memory:
    def __init__(self, robot: HostilePepper) -> None:
        self._robot = robot

    def getListData(self, keys: list[str]) -> Any:
        honest = [2.0 if "Laser" in key else 0.5 for key in keys]
        return self._robot.reply("getListData", honest, str(len(keys)))

    def getTimestamp(self, key: str) -> Any:
        return self._robot.reply("getTimestamp", [None, 0, 0])

    def insertData(self, key: str, value: Any) -> Any:
        return None


class Motion:
    def __init__(self, robot: HostilePepper) -> None:
        self._robot = robot

    def getBodyNames(self, group: str) -> Any:
        return self._robot.reply("getBodyNames", ["HeadYaw", "HeadPitch"])

    def robotIsWakeUp(self) -> Any:
        return self._robot.reply("robotIsWakeUp", True)

    def moveIsActive(self) -> Any:
        return self._robot.reply("moveIsActive", False)

    def getRobotPosition(self, sensors: bool) -> Any:
        return self._robot.reply("getRobotPosition", [0.0, 0.0, 0.0])

    def getRobotVelocity(self) -> Any:
        return self._robot.reply("getRobotVelocity", [0.0, 0.0, 0.0])

    def getPosition(self, name: str, frame: int, sensors: bool) -> Any:
        return self._robot.reply("getPosition", [0.0] * 6)

    def setAngles(self, *_: Any) -> None:
        """The head is raised at the start."""

    def wakeUp(self) -> None:
        """It is awake."""

    def stopMove(self) -> None:
        """It stands."""

    def killMove(self) -> None:
        """It stands."""

    def move(self, x: float, y: float, theta: float) -> None:
        self._robot.velocities.append((x, y, theta))

    moveTo = move


class Sonar:
    def __init__(self, robot: HostilePepper) -> None:
        self._robot = robot

    def subscribe(self, name: str) -> None:
        """They are on."""

    def unsubscribe(self, name: str) -> None:
        """They stay on."""


class Video:
    def __init__(self, robot: HostilePepper) -> None:
        self._robot = robot

    def getSubscribers(self) -> Any:
        return []

    def subscribeCamera(self, *_: Any) -> str:
        return "handle"

    def unsubscribe(self, handle: str) -> bool:
        return True

    @qi.bind(qi.Dynamic, (qi.String,))
    def getImageRemote(self, handle: str) -> Any:
        now = time.time()
        return self._robot.reply("getImageRemote", picture(int(now), int(now % 1 * 1e6)))


def picture(seconds: int = 1, microseconds: int = 0, width: int = WIDTH, height: int = HEIGHT) -> list:
    return [width, height, 3, 11, seconds, microseconds, b"", 0, 0.5, 0.4, -0.5, -0.4]


def nested(depth: int) -> list:
    value: list = []
    for _ in range(depth):
        value = [value]
    return value


class Scene:
    """The robot, and the programs that ask it."""

    def __init__(self, nodes: BareNodes, robot: HostilePepper) -> None:
        self.robot = robot
        self.front = TlsFront(robot.port, None)
        """Between robot and joint driver, without TLS: hears what is said."""
        here = ("--pip=127.0.0.1", f"--pport={robot.port}")
        self._programs: dict[str, BareNode] = {
            "robotIsWakeUp": nodes.node("naoqi_driver_py", "naoqi_moveto.py", *here),
            "getPosition or getBodyNames": nodes.node(
                "naoqi_driver_py",
                "naoqi_joint_states.py",
                "--pip=127.0.0.1",
                f"--pport={self.front.port}",
                "_sensor_rate:=5",
            ),
            "getListData 8": nodes.node("naoqi_driver_py", "naoqi_condition.py", *here),
            "getImageRemote": nodes.node(
                "telepresence_1", "rob_cam.py", "127.0.0.1", str(robot.port), "--page-port", str(free_port())
            ),
        }
        self._wait_asked("")

    def _wait_asked(self, what: str) -> None:
        """Wait until every program that asks for `what` has asked once more, or has ended."""
        before = {name: self._count(name) for name in self._programs if what in name}

        for name, count in before.items():
            program = self._programs[name]
            try:
                wait_until(
                    lambda name=name, count=count, program=program: self._count(name) > count or not program.alive,
                    f"somebody asks for {name}",
                )
            except AssertionError:
                program.kill()  # the next attack finds a new one
                raise

    def _count(self, questions: str) -> int:
        return sum(self.robot.asked.get(name, 0) for name in questions.split(" or "))

    def attack(self, lie: Callable[[str], Any], what: str = "") -> None:
        """Lie to those who ask for `what`; "" is everybody."""
        if not all(program.alive for program in self._programs.values()):
            for program in self._programs.values():
                program.ensure()
            self._wait_asked("")
        begun = time.monotonic()
        before = {name: len(program.output) for name, program in self._programs.items()}
        velocities = len(self.robot.velocities)
        self.robot.lie = lie
        self._wait_asked(what)
        self.robot.lie = None
        self._wait_asked(what)
        for name, program in self._programs.items():
            said = program.output[before[name] :]
            assert program.alive, f"it ended:\n{said[-2000:]}"
            lines = [line for line in said.splitlines() if line and not line.startswith("[W]")]
            assert len(lines) <= LINES_ALLOWED + time.monotonic() - begun, said[-2000:]
            assert all(len(line) < 600 and line.isprintable() for line in lines), said[-2000:]
            assert "Traceback" not in said, said[-2000:]
        assert len(self.robot.velocities) == velocities, "the robot was driven"


@pytest.fixture(scope="module")
def nodes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BareNodes]:
    nodes = BareNodes(tmp_path_factory.mktemp("pepper"), NAO_USER="nao", NAO_PASSWORD=SECRET, DISPLAY="")
    yield nodes
    nodes.close()


@pytest.fixture(scope="module")
def robot() -> Iterator[HostilePepper]:
    robot = HostilePepper()
    yield robot
    robot.close()


@pytest.fixture(scope="module")
def scene(nodes: BareNodes, robot: HostilePepper) -> Iterator[Scene]:
    scene = Scene(nodes, robot)
    yield scene
    scene.front.close()


def refuse(text: str) -> Callable[[str], Any]:
    def lie(_method: str) -> Any:
        raise ValueError(text)

    return lie


LIES: dict[str, Callable[[str], Any]] = {
    "nothing": lambda _: None,
    "a number": lambda _: 7,
    "a text with control characters": lambda _: "\x1b[2J\x1b]0;owned\x07" * 20_000,
    "an empty list": lambda _: [],
    "a list too long": lambda _: [0.0] * 21_000,
    "texts for numbers": lambda _: ["9" * 400] * 98,
    "NaN everywhere": lambda _: [math.nan] * 6,
    "infinity everywhere": lambda _: [math.inf] * 3,
    "numbers that no float32 holds": lambda method: [1e300] * (100 if method == "getListData" else 3),
    "lists 900 deep": lambda _: nested(900),
    "a dictionary": lambda _: {"a": [1, {"b": "c"}]},
    "an object": lambda _: Sonar(None),
    "an error of 500 kB with control characters": refuse("no\x1b[2J\x07 " * 50_000),
    "a refusal to move with control characters": lambda _: [["\x1b[2J" * 1000, 1, [0.0, 0.0, 0.0]], time.time_ns(), 1],
}
PICTURES: dict[str, list] = {
    "negative size": picture(width=-640, height=-480),
    "a million by a million": picture(width=1_000_000, height=1_000_000),
    "without pixels": picture(width=0, height=0),
    "before time began": picture(seconds=-(2**40)),
    "of NaN": [math.nan] * 12,
    "parts missing": picture()[:7],
}


@pytest.mark.parametrize("lie", LIES.values(), ids=[name.replace(" ", "_") for name in LIES])
def test_a_reply_ends_a_node(lie: Callable[[str], Any], scene: Scene) -> None:
    """Nobody ends, floods the log, or writes what a terminal obeys; the robot is not driven."""
    scene.attack(lie)


@pytest.mark.parametrize("lie", PICTURES.values(), ids=[name.replace(" ", "_") for name in PICTURES])
def test_a_picture_ends_who_shows_it(lie: list, scene: Scene) -> None:
    scene.attack(lambda method: lie if method == "getImageRemote" else HONEST, "getImageRemote")


# --- the password ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("certificates")
    return make_certificate(folder, "pepper"), make_certificate(folder, "mallory")


def test_the_password_goes_over_the_network_in_the_clear(scene: Scene) -> None:
    """With tcp nobody gets the password, though NAO_PASSWORD has one."""
    wait_until(lambda: len(scene.front.received) > 500, "the driver speaks")
    assert SECRET.encode() not in scene.front.received


def test_whoever_answers_later_at_the_robots_address_gets_the_password(
    nodes: BareNodes, robot: HostilePepper, certificates: tuple[Path, Path]
) -> None:
    """The robot's certificate is known from the first connection; another one gets not a byte."""
    front = TlsFront(robot.port, certificates[0])
    nodes.node("naoqi_driver_py", "naoqi_joint_states.py", f"--pip=tcps://127.0.0.1:{front.port}", "__name:=encrypted")
    wait_until(lambda: SECRET.encode() in front.received, "the robot gets the password")
    front.received = b""
    tried = front.connections
    front.show(certificates[1])
    wait_until(lambda: front.connections > tried + 1 or SECRET.encode() in front.received, "the driver tries again")
    front.close()
    assert SECRET.encode() not in front.received
