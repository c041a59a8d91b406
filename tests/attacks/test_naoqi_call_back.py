"""Somebody on the pilot's machine or the robot's network, and somebody on the robot, against the port at which the
robot brings the sound of its microphones.

An attack has failed when nobody but the robot's address gets a word, the robot's address gets at nothing but
`processRemote`, and the robot is heard afterwards.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from collections.abc import Iterator

import pytest
from messaging.resets import usage
from naoqi_bytes import CALL, ERROR, HEADER, LOGIN, MAGIC, POST, REPLY, Closed, Message, RawPeer, members, text
from naoqi_driver.call_back import LIMITS
from telepresence_1.microphone_stream import _listener

from telepresence.naoqi import Session
from telepresence.naoqi.server import Server

ROBOT, STRANGER = "127.0.0.2", "127.0.0.1"
SAMPLES = 1365
BLOCK = struct.pack("<ii", 1, SAMPLES) + text("[m]") + bytes(4) + struct.pack("<I", 2 * SAMPLES) + bytes(2 * SAMPLES)
"""Arguments of processRemote as the robot's front microphone brings them; without a time."""
GROWTH = 24.0
"""What this process may hold more after an attack than before [MB]."""


class Ear:
    """A session that listens for the robot with one service, and what came there."""

    def __init__(self) -> None:
        self.heard: list[int] = []
        self._robot = Server("tcp://127.0.0.1:0")
        self._robot.start()
        self._session = Session()
        self._session.connect(self._robot.endpoints[0])
        self._session.listen("tcp://127.0.0.1:0", only_from=[ROBOT], limits=LIMITS)
        self.place = "127.0.0.1", int(self._session.endpoints()[0].rpartition(":")[2])
        service = _listener(lambda _channels, count, _buffer: self.heard.append(count))
        self.number = self._session.registerService("PilotsEars", service)
        with self.peer() as peer:
            described = peer.answer(Message(CALL, self.number, 1, 2, bytes(4))).payload
        self.process_remote = members(described)["processRemote"]

    def open(self, source: str) -> RawPeer:
        """Connect from an address."""
        return RawPeer(socket.create_connection(self.place, 20.0, (source, 0)))

    def peer(self) -> RawPeer:
        """A program on the robot, logged in."""
        peer = self.open(ROBOT)
        peer.log_in()
        return peer

    def call(self, peer: RawPeer) -> None:
        answer = peer.answer(Message(CALL, self.number, 1, self.process_remote, BLOCK, identity=77))
        assert answer.kind == REPLY, answer

    def close(self) -> None:
        self._session.close()
        self._robot.close()


@pytest.fixture(scope="module")
def the_ear() -> Iterator[Ear]:
    ear = Ear()
    yield ear
    ear.close()


@pytest.fixture
def ear(the_ear: Ear) -> Iterator[Ear]:
    """It hears the robot before and after the attack."""
    with the_ear.peer() as peer:
        the_ear.call(peer)
    before = usage(os.getpid())[0]
    yield the_ear
    the_ear.heard.clear()
    with the_ear.peer() as peer:
        the_ear.call(peer)
    assert the_ear.heard, "what a flood has left may come, too"
    assert usage(os.getpid())[0] <= before + GROWTH


@pytest.mark.parametrize("first", [LOGIN.pack(), b"GET / HTTP/1.1\r\n\r\n", b""], ids=["login", "HTTP", "nothing"])
def test_a_stranger_gets_no_word(ear: Ear, first: bytes) -> None:
    with ear.open(STRANGER) as stranger, pytest.raises((Closed, ConnectionError)):
        stranger.send(first)
        stranger.receive()


def test_a_crowd_of_strangers_does_not_keep_the_robot_out(ear: Ear) -> None:
    with ear.peer() as robot, contextlib.ExitStack() as crowd:
        for _ in range(300):
            with contextlib.suppress(OSError):
                crowd.enter_context(ear.open(STRANGER)).send(LOGIN)
        ear.call(robot)
        with ear.peer() as another:
            ear.call(another)


def calls(ear: Ear) -> dict[str, Message]:
    """What is not for the robot, nor for a program on it: name -> call."""
    info = text("Trojan") + struct.pack("<I", 0) + text("") + struct.pack("<II", 0, 0) + text("") + text("")
    listed = {
        "the directory's services": Message(CALL, 1, 1, 101),
        "the directory's service": Message(CALL, 1, 1, 100, text("PilotsEars")),
        "the directory's registerService": Message(CALL, 1, 1, 102, info),
        "the directory's metaObject": Message(CALL, 1, 1, 2, bytes(4)),
        "another service": Message(CALL, ear.number + 1, 1, 100),
        "another object": Message(CALL, ear.number, 2, 100),
        "registerEvent": Message(CALL, ear.number, 1, 0, struct.pack("<IIQ", 1, ear.process_remote, 1)),
        "property": Message(CALL, ear.number, 1, 5, text("s") + text("__class__")),
        "setProperty": Message(CALL, ear.number, 1, 6, text("s") + text("processRemote") + text("s") + text("x")),
    }
    others = {a for a in range(256) if a not in (2, 3, 7, ear.process_remote)}
    return listed | {f"action {action}": Message(CALL, ear.number, 1, action) for action in others}


def test_the_robot_gets_at_nothing_but_the_microphones_service(ear: Ear) -> None:
    with ear.peer() as robot:
        for name, call in calls(ear).items():
            assert robot.answer(call._replace(identity=5)).kind == ERROR, name
        assert robot.answer(Message(CALL, ear.number, 1, 7, identity=6)).payload == bytes(4), "it has properties"


def test_posts_to_what_is_not_there_change_nothing(ear: Ear) -> None:
    with ear.peer() as robot:
        ear.heard.clear()
        for call in calls(ear).values():
            robot.send(call._replace(kind=POST))
        ear.call(robot)
    assert ear.heard == [SAMPLES]


def ended(peer: RawPeer, patience: float = 20.0) -> bool:
    with peer:
        return peer.gone(patience)


@pytest.mark.parametrize(
    "said",
    [
        b"\0" * 64,
        os.urandom(4096),
        HEADER.pack(MAGIC, 1, LIMITS.payload + 1, 0, CALL, 0, 2, 1, 100),
        HEADER.pack(MAGIC, 1, 2**32 - 1, 0, POST, 0, 2, 1, 100),
    ],
    ids=["zeros", "noise", "too large", "4 GiB"],
)
@pytest.mark.parametrize("before", ["the login", "nothing"])
def test_garbage_ends_its_connection(ear: Ear, said: bytes, before: str) -> None:
    peer = ear.peer() if before == "nothing" else ear.open(ROBOT)
    peer.send(said)
    assert ended(peer)


def test_who_does_not_log_in_is_sent_away(ear: Ear) -> None:
    assert ended(ear.open(ROBOT), LIMITS.login_s + 5.0)


def test_of_connections_that_do_not_log_in_few_are_held(ear: Ear) -> None:
    with contextlib.ExitStack() as flood:
        peers = [flood.enter_context(ear.open(ROBOT)) for _ in range(100)]
        with ear.peer() as robot:
            ear.call(robot)
        held = [peer for peer in peers if not peer.gone(0.05)]
    assert len(held) <= LIMITS.connections


@pytest.mark.parametrize("kind", [CALL, POST])
def test_a_flood_of_sound_whose_answers_nobody_reads_holds_up_itself(ear: Ear, kind: int) -> None:
    with ear.peer() as flood, ear.peer() as robot:
        flood.socket.settimeout(0.5)
        message = Message(kind, ear.number, 1, ear.process_remote, BLOCK, identity=9).pack()
        with contextlib.suppress(TimeoutError, ConnectionError):
            for _ in range(20_000):
                flood.send(message)
        ear.call(robot)


@pytest.mark.parametrize(
    "arguments",
    [b"", bytes(8), struct.pack("<ii", -1, 2**31 - 1) + BLOCK[8:], BLOCK[:-1], text("(m)") * 2000],
    ids=["none", "few", "absurd numbers", "cut off", "nested"],
)
def test_arguments_that_are_none_are_refused_or_left_out(ear: Ear, arguments: bytes) -> None:
    with ear.peer() as robot:
        robot.send(Message(CALL, ear.number, 1, ear.process_remote, arguments, identity=8))
        with contextlib.suppress(Closed, ConnectionError):
            assert robot.next().kind in (ERROR, REPLY)
