"""Somebody on the robot's network against our server of NAOqi's messaging, in a process of its own.

An attack has failed when afterwards a new client is served, and the server has given back its descriptors, threads and
memory. What each end allows the other stands in telepresence/naoqi/limits.py.
"""

from __future__ import annotations

import os
import struct
import time
from collections.abc import Callable, Iterator

import pytest
from messaging.resets import reset_rounds, usage
from naoqi_bytes import (
    CALL,
    CANCEL,
    CAPABILITY,
    ERROR,
    EVENT,
    HEADER,
    LOGIN,
    MAGIC,
    POST,
    REPLY,
    Message,
    RawPeer,
    dynamic,
    members,
    text,
)  # fmt: skip
from naoqi_services import OURS, ServerProcess

ADD = Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2), identity=77)
GROWTH = 24.0
"""What the server may hold more after an attack than before [MB]: its allocator does not give everything back."""
LOGIN_SECONDS = 3.0
"""A login may take; ten by default."""
SOON = 15.0
"""Seconds in which all that belongs to an attack must be gone; workers that are idle end after two."""


class Robot:
    """The server under attack."""

    def __init__(self) -> None:
        self.start()

    def start(self) -> None:
        self.process = ServerProcess(OURS, "--release", "2.8", "--login-seconds", str(LOGIN_SECONDS))
        self.url = self.process.urls["2.8"]
        self.address = ("127.0.0.1", int(self.url.rpartition(":")[2]))
        self.served()
        self.members = self._members("Conversation")

    @property
    def alive(self) -> bool:
        return self.process.process.poll() is None

    def peer(self, patience: float = 20.0) -> RawPeer:
        peer = RawPeer(self.address, patience)
        peer.log_in()
        return peer

    def served(self) -> float:
        """Log in as a new client and call; the seconds that it took."""
        begin = time.monotonic()
        with self.peer() as peer:
            assert peer.answer(ADD).payload == struct.pack("<i", 3)
        return time.monotonic() - begin

    def _members(self, service: str) -> dict[str, tuple[int, int]]:
        """Member -> (service, action)."""
        with self.peer() as peer:
            record = peer.answer(Message(CALL, 1, 1, 100, text(service))).payload
            (number,) = struct.unpack_from("<I", record, 4 + len(service))
            described = peer.answer(Message(CALL, number, 1, 2, bytes(4))).payload
        return {name: (number, action) for name, action in members(described).items()}


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    robot = Robot()
    yield robot
    robot.process.close()


def quiet(pid: int, before: tuple[float, int, int]) -> tuple[float, int, int]:
    """What the server uses when it is as before, or after a while."""
    deadline = time.monotonic() + SOON
    while True:
        now = usage(pid)
        calm = now[0] <= before[0] + GROWTH and now[1] <= before[1] and now[2] <= max(before[2], BASE_THREADS)
        if calm or time.monotonic() > deadline:
            return now
        time.sleep(0.05)


@pytest.fixture
def unharmed(robot: Robot) -> Iterator[Robot]:
    """The server, before and after an attack."""
    if not robot.alive:  # the attack before this one got through
        robot.start()
    before = usage(robot.process.pid)
    yield robot
    assert robot.alive, "it ended"
    robot.served()
    memory, descriptors, threads = quiet(robot.process.pid, before)
    assert memory <= before[0] + GROWTH, f"memory grew from {before[0]:.0f} to {memory:.0f} MB"
    assert descriptors <= before[1], "descriptors are left"
    assert threads <= max(before[2], BASE_THREADS), "threads are left"


BASE_THREADS = 12
"""Threads of a server at rest: its own, the reactor's, a few workers and timers."""


# --- bytes that are no message ---------------------------------------------------------------------------------------

NESTED = 20_000
DEEP_LISTS = b"".join(dynamic("[m]", struct.pack("<I", 1)) for _ in range(NESTED)) + dynamic("i", bytes(4))
DEEP_DYNAMICS = text("m") * NESTED + dynamic("i", bytes(4))
MEGABYTE = 1 << 20

STRANGE = {
    "a web page's request": b"GET / HTTP/1.1\r\nHost: robot\r\nContent-Length: 5\r\n\r\nhello",
    "TLS": bytes.fromhex("16030102000100") + bytes(512),
    "zeros": bytes(65536),
    "random bytes": os.urandom(65536),
    "a header of ones": b"\xff" * 28,
    "4 GiB announced": Message(CALL, 0, 0, 8, b"\1" * 1000).pack(size=2**32 - 1),
    "64 MiB announced before the login": Message(CALL, 0, 0, 8, b"\1" * 1000).pack(size=64 << 20),
    "a map of four billion": Message(CALL, 0, 0, 8, b"\xff" * 4).pack(),
    "a map of ten thousand": Message(
        CALL, 0, 0, 8, struct.pack("<I", 10_000) + b"".join(text(f"k{n}") + dynamic("b", b"\1") for n in range(10_000))
    ).pack(),
    "a key of four billion letters": Message(CALL, 0, 0, 8, struct.pack("<II", 1, 2**32 - 1) + b"k").pack(),
    "dynamics without end in the login": Message(
        CALL, 0, 0, 8, struct.pack("<I", 1) + text("auth_user") + DEEP_DYNAMICS
    ).pack(),
    "lists without end in the login": Message(
        CALL, 0, 0, 8, struct.pack("<I", 1) + text("auth_user") + DEEP_LISTS
    ).pack(),
    "a signature without end in the login": Message(
        CALL, 0, 0, 8, struct.pack("<I", 1) + text("auth_user") + text("[" * 50_000) + bytes(4)
    ).pack(),
    "capabilities that are none": Message(CAPABILITY, 0, 0, 0, b"\xff" * 100).pack(),
    "an answer to nothing": Message(REPLY, 0, 0, 8, bytes(4), identity=2**32 - 1).pack(),
    "a call of nobody": Message(CALL, 2**32 - 1, 2**32 - 1, 2**32 - 1, b"\xff" * 100).pack(),
    "half a header": MAGIC + b"\1",
    "half a payload": LOGIN.pack()[:60],
    "nothing": b"",
}


@pytest.mark.parametrize("data", STRANGE.values(), ids=STRANGE)
def test_before_the_login(unharmed: Robot, data: bytes) -> None:
    with RawPeer(unharmed.address) as stranger:
        try:
            stranger.send(data)
        except ConnectionError:
            pass  # closed in the middle of it, which is an answer
        unharmed.served()
        assert usage(unharmed.process.pid)[0] < 400.0


def called(payload: bytes, flags: int = 0, kind: int = CALL, action: int = 113) -> bytes:
    return Message(kind, 2, 1, action, payload, flags=flags).pack()


STRANGE_CALLS = {
    "4 GiB announced": Message(CALL, 2, 1, 113, b"\1" * 1000).pack(size=2**32 - 1),
    "64 MiB announced": Message(CALL, 2, 1, 113, b"\1" * 1000).pack(size=64 << 20),
    "lists without end": called(DEEP_LISTS),
    "dynamics without end": called(DEEP_DYNAMICS),
    "a signature of lists without end": called(text("[" * 50_000) + bytes(4)),
    "a signature that never closes": called(text("(" * MEGABYTE) + bytes(4)),
    "a signature of a megabyte": called(text("(" + "i" * MEGABYTE + ")") + bytes(4 * MEGABYTE)),
    "a signature of a million nothings": called(text("[" + "(" + "v" * MEGABYTE + ")" + "]") + b"\xff\xff\xff\xff"),
    "an annotation of a megabyte": called(text("(i)<" + "x," * (MEGABYTE // 2) + ">") + bytes(4)),
    "four billion nothings": called(dynamic("[v]", b"\xff" * 4)),
    "four billion empty tuples": called(dynamic("[()]", b"\xff" * 4)),
    "four billion numbers": called(dynamic("[i]", b"\xff" * 4)),
    "four billion letters": called(dynamic("s", b"\xff" * 4)),
    "four billion pairs": called(dynamic("{mm}", b"\xff" * 4)),
    "a key that cannot be one": called(dynamic("{[m]m}", struct.pack("<III", 1, 0, 1) + text("v"))),
    "an unknown type": called(text("Q") + bytes(8)),
    "no bytes": called(b""),
    "one dynamic of a megabyte signature": called(text("i" * MEGABYTE), flags=1),
    "a wanted type of a megabyte": called(struct.pack("<ii", 1, 2) + text("[" * MEGABYTE), flags=2, action=100),
    "a truth that is none": called(dynamic("b", b"\7")),
    "text that is none": called(dynamic("s", text(b"\xff\xfe\xc0\xaf"))),
    "an object that is none": called(dynamic("o", b"\xff" * 200)),
    "an object of nobody": called(
        dynamic("o", struct.pack("<IIII", 0, 0, 0, 0) + struct.pack("<II", 99, 99) + bytes(20))
    ),
    "a property of strange name": called(dynamic("[m]", b"\xff" * 4), action=5),
    "a link to nothing": called(struct.pack("<IIQ", 2, 2**32 - 1, 1), action=0),
    "a link with a strange signature": called(struct.pack("<IIQ", 2, 115, 1) + text("(" * 50_000), action=8),
    "a post of strange bytes": called(b"\xff" * 100, kind=POST),
    "an event from a stranger": called(b"\xff" * 100, kind=EVENT),
    "a cancel of strange bytes": called(b"\1", kind=CANCEL),
    "an error to nothing": called(b"\xff" * 100, kind=ERROR),
    "capabilities of a megabyte": Message(CAPABILITY, 0, 0, 0, b"\xff" * MEGABYTE).pack(),
    "a service's strange record": Message(CALL, 1, 1, 102, b"\xff" * 64).pack(),
    "somebody else's service ended": Message(CALL, 1, 1, 104, struct.pack("<I", 2)).pack(),
}


@pytest.mark.parametrize("data", STRANGE_CALLS.values(), ids=STRANGE_CALLS)
def test_after_the_login(unharmed: Robot, data: bytes) -> None:
    with unharmed.peer() as stranger:
        try:
            stranger.send(data)
        except ConnectionError:
            pass
        unharmed.served()
        assert usage(unharmed.process.pid)[0] < 400.0


# --- a conversation that ends anywhere -------------------------------------------------------------------------------


def conversation(robot: Robot) -> list[bytes]:
    """A login, links, calls, a call that is open, an own service, and a cancel."""
    number, never = robot.members["never"]
    messages = [
        LOGIN,
        Message(CALL, 1, 1, 2, bytes(4)),
        Message(CALL, 1, 1, 0, struct.pack("<IIQ", 1, 106, 9)),
        Message(CALL, 2, 1, 0, struct.pack("<IIQ", 2, 115, 13)),
        ADD,
        Message(CALL, number, 1, never, identity=40),
        Message(CALL, 1, 1, 102, record("Mine"), identity=41),
        Message(POST, 2, 1, 115, struct.pack("<i", 3) + text("hey")),
        Message(CANCEL, number, 1, 0, struct.pack("<I", 40), identity=42),
    ]
    return [message.pack() for message in messages]


@pytest.mark.parametrize("ending", [RawPeer.reset, RawPeer.close], ids=["reset", "closed"])
def test_a_conversation_ends_after_and_inside_every_message(unharmed: Robot, ending: Callable[[RawPeer], None]) -> None:
    messages = conversation(unharmed)
    begin = 0
    for message in messages:
        for length in (1, HEADER.size - 1, HEADER.size, (HEADER.size + len(message)) // 2, len(message)):
            stranger = RawPeer(unharmed.address)
            stranger.send(b"".join(messages)[: begin + length])
            if length == len(message) and len(message) > HEADER.size:
                stranger.socket.recv(1)  # the server has read it, and may be answering
            ending(stranger)
        begin += len(message)
    unharmed.served()


def record(name: str) -> bytes:
    """A ServiceInfo."""
    begin = text(name) + struct.pack("<I", 0) + text("machine") + struct.pack("<I", 1)
    return begin + struct.pack("<I", 1) + text("tcp://127.0.0.1:1") + text("session") + text(bytes(20))


def register(peer: RawPeer, name: str) -> None:
    number = peer.answer(Message(CALL, 1, 1, 102, record(name))).payload
    assert peer.answer(Message(CALL, 1, 1, 104, number)).kind == REPLY


def test_a_client_that_is_cut_leaves_no_service(unharmed: Robot) -> None:
    with unharmed.peer() as stranger, unharmed.peer() as watcher:
        register(stranger, "Mine")
        assert watcher.answer(Message(CALL, 1, 1, 100, text("Mine"))).kind == REPLY
        stranger.reset()
        deadline = time.monotonic() + SOON
        while watcher.answer(Message(CALL, 1, 1, 100, text("Mine"))).kind != ERROR:
            assert time.monotonic() < deadline, "the service of a dead client is still listed"


# --- many ------------------------------------------------------------------------------------------------------------


def test_connections_reset_before_they_are_accepted(unharmed: Robot) -> None:
    """`./stack bench naoqi --resets` does it a hundred times with ten thousand."""

    def served_in_time() -> bool:
        found = reset_rounds(unharmed.url, unharmed.process.pid, times=3, count=200, progress=False)
        assert found.connected == [200] * 3
        return found.in_time == 3

    assert any(served_in_time() for _ in range(4)), "of a busy machine three rounds in a row may not be in time"


def test_two_hundred_clients_at_once(unharmed: Robot) -> None:
    peers = [RawPeer(unharmed.address) for _ in range(200)]
    for peer in peers:
        peer.send(LOGIN)
    for peer in peers:
        assert peer.next().kind == REPLY
    for _ in range(3):
        for peer in peers:
            peer.send(ADD)
        for peer in peers:
            assert peer.next().payload == struct.pack("<i", 3)
    for peer in peers:
        peer.close()


def test_a_client_never_reads_what_it_asks_for(unharmed: Robot) -> None:
    """Requests for half a gigabyte: the server stops reading them, or closes; the others do not notice."""
    number, data = unharmed.members["data"]
    before = usage(unharmed.process.pid)[0]
    with unharmed.peer() as stranger:
        stranger.socket.settimeout(0.3)
        try:
            for identity in range(512):
                stranger.send(Message(CALL, number, 1, data, struct.pack("<i", MEGABYTE), identity=identity))
        except OSError:
            pass
        for _ in range(5):
            unharmed.served()
        # The arguments are four bytes, so all of them fit; their answers must not.
        assert usage(unharmed.process.pid)[0] < before + 160.0


def test_a_client_never_reads_its_events(unharmed: Robot) -> None:
    number, signal = unharmed.members["anything"]
    before = usage(unharmed.process.pid)[0]
    blob = dynamic("(r)", text(bytes(256 * 1024)))
    with unharmed.peer() as deaf, unharmed.peer() as speaker:
        assert deaf.answer(Message(CALL, number, 1, 0, struct.pack("<IIQ", number, signal, 1))).kind == REPLY
        for _ in range(200):
            speaker.send(Message(POST, number, 1, signal, blob))
        assert speaker.answer(ADD).kind == REPLY
        unharmed.served()
        assert usage(unharmed.process.pid)[0] < before + 64.0


def test_a_service_that_never_answers(unharmed: Robot) -> None:
    """Forty calls wait for a client that is silent; the others are served, and the calls end with the client."""
    call, back = unharmed.members["call_back"]
    with unharmed.peer() as silent, unharmed.peer() as caller:
        register(silent, "Silent")
        arguments = text("Silent") + text("anything") + dynamic("[m]", bytes(4))
        for identity in range(40):
            caller.send(Message(CALL, call, 1, back, arguments, identity=1000 + identity))
        for _ in range(5):
            unharmed.served()
        silent.reset()
        assert {caller.next().kind for _ in range(40)} == {ERROR}


def test_bytes_so_slow_that_no_login_ends(unharmed: Robot) -> None:
    """A hundred that send a byte at a time; each keeps a descriptor and nothing else, until its time is over."""
    slow = [RawPeer(unharmed.address) for _ in range(100)]
    for place in range(10):
        for stranger in slow:
            stranger.send(LOGIN.pack()[place : place + 1])
        unharmed.served()
    threads = usage(unharmed.process.pid)[2]
    assert threads <= BASE_THREADS
    assert slow[0].gone(30.0), "a login that never ends is never ended"
    for stranger in slow:
        stranger.close()


def flood(robot: Robot, message: Callable[[int], Message], count: int) -> None:
    """Send all of them, reading what comes back; being refused or closed is what is hoped for."""
    with robot.peer() as stranger:
        try:
            for begin in range(0, count, 500):
                batch = b"".join(message(number).pack() for number in range(begin, min(count, begin + 500)))
                stranger.socket.sendall(batch)
                stranger.socket.setblocking(False)
                try:
                    while stranger.socket.recv(1 << 20):
                        pass
                except BlockingIOError:
                    pass
                stranger.socket.settimeout(20.0)
            robot.served()
        except (ConnectionError, TimeoutError):
            pass


def test_a_flood_of_links(unharmed: Robot) -> None:
    flood(unharmed, lambda n: Message(CALL, 2, 1, 0, struct.pack("<IIQ", 2, 115, n), identity=n), 15_000)


def test_a_flood_of_objects(unharmed: Robot) -> None:
    number, subscriber = unharmed.members["subscriber"]
    flood(unharmed, lambda n: Message(CALL, number, 1, subscriber, text("x"), identity=n), 2_000)


def test_a_flood_of_open_calls(unharmed: Robot) -> None:
    number, never = unharmed.members["never"]
    flood(unharmed, lambda n: Message(CALL, number, 1, never, identity=n), 3_000)


@pytest.mark.parametrize("length", [10, MEGABYTE])
def test_a_flood_of_services(unharmed: Robot, length: int) -> None:
    """Small names by the thousand, or a few of a megabyte."""

    count = 1_000 if length == 10 else 20
    flood(unharmed, lambda n: Message(CALL, 1, 1, 102, record(f"{n:0>{length}}"), identity=n), count)
