"""Whoever answers at the robot's address against our client of NAOqi's messaging.

An attack has failed when every wait of the client ended in time with a RuntimeError or an answer, memory stayed where
it was, and the same client talks to an honest server afterwards.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import math
import os
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from messaging.resets import usage
from naoqi_bytes import (
    CALL,
    CANCELED,
    CAPABILITIES,
    CAPABILITY,
    ERROR,
    EVENT,
    HEADER,
    MAGIC,
    POST,
    REPLY,
    Message,
    RawPeer,
    dynamic,
    flags,
    text,
)  # fmt: skip
from naoqi_relay import Between, Impostor, forward
from naoqi_services import OURS, ServerProcess

import telepresence.naoqi as naoqi

MS = 20_000
GROWTH = 24.0
"""What this process may hold more after an attack than before [MB]."""
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, SMALL = -1, -3, 128 * 1024
"""Parameters of mallopt (malloc.h), and glibc's own value of both."""
THREADS = 16
"""Threads of this process at rest: pytest's, the reactor's, and a few workers."""
MEGABYTE = 1 << 20
MANY = struct.pack("<I", 2**32 - 1)
LOGGED_IN = (
    struct.pack("<I", 7) + flags(*CAPABILITIES)[4:] + text("__qi_auth_state") + dynamic("I", struct.pack("<I", 3))
)


@pytest.fixture(scope="module")
def honest() -> Iterator[ServerProcess]:
    with ServerProcess(OURS) as server:
        yield server


@pytest.fixture(scope="module", autouse=True)
def returned_memory() -> Iterator[None]:
    """What is freed goes back to the system, whatever env.sh says, so that what is not can be seen."""
    mallopt = ctypes.CDLL(None).mallopt
    names = {M_TRIM_THRESHOLD: "MALLOC_TRIM_THRESHOLD_", M_MMAP_THRESHOLD: "MALLOC_MMAP_THRESHOLD_"}
    for option in names:
        mallopt(option, SMALL)
    yield
    for option, name in names.items():
        mallopt(option, int(os.environ.get(name, SMALL)))


@pytest.fixture(autouse=True)
def unharmed(honest: ServerProcess) -> Iterator[None]:
    """This process is as before when the attack is over."""
    _visit(honest.url)
    before = used()
    yield
    _visit(honest.url)
    deadline = time.monotonic() + 15.0
    collected = -math.inf
    # Workers that are idle end after two seconds.
    while (now := used())[1] > before[1] or now[2] > max(before[2], THREADS) or now[0] > before[0] + GROWTH:
        assert time.monotonic() < deadline, f"memory, descriptors, threads: {before} before, {now} after"
        if time.monotonic() - collected > 1.0:  # after thousands of tests it takes half a second
            gc.collect()
            collected = time.monotonic()
        time.sleep(0.05)


def used() -> tuple[float, int, int]:
    """Memory [MB], descriptors and threads of this process."""
    return usage(os.getpid())


def _visit(url: str) -> None:
    session = naoqi.Session()
    session.connect(url)
    assert session.service("Recorded").add(1, 2) == 3
    session.close()


def try_to_connect(url: str) -> None:
    """It works or is refused; in time."""
    session = naoqi.Session()
    future = session.connect(url, timeout=1.0, _async=True)
    future.wait(MS)
    assert not future.isRunning(), "connecting has no end"
    session.close()


# --- the login -------------------------------------------------------------------------------------------------------

NESTED = text("m") * 20_000 + dynamic("i", bytes(4))


def login(payload: bytes, kind: int = REPLY, **more: Any) -> Callable[[RawPeer], None]:
    """Answer the first message with this, and the others not."""

    def talk(peer: RawPeer) -> None:
        first = peer.receive()
        peer.send(Message(kind, 0, 0, 8, payload, identity=first.identity, **more))
        peer.gone()

    return talk


def raw(data: bytes) -> Callable[[RawPeer], None]:
    def talk(peer: RawPeer) -> None:
        peer.send(data)
        peer.gone()

    return talk


def state_one_for_ever(peer: RawPeer) -> None:
    """libqi's client asks again thousands of times."""
    for count in range(1000):
        asked = peer.receive()
        assert count < 3
        entry = text("__qi_auth_state") + dynamic("I", struct.pack("<I", 1))
        peer.send(Message(REPLY, 0, 0, 8, struct.pack("<I", 1) + entry, identity=asked.identity))


def state_two_for_ever(peer: RawPeer) -> None:
    while True:
        asked = peer.receive()
        entry = (
            text("__qi_auth_state")
            + dynamic("I", struct.pack("<I", 2))
            + text("auth_newToken")
            + dynamic("s", text("x"))
        )
        peer.send(Message(REPLY, 0, 0, 8, struct.pack("<I", 2) + entry, identity=asked.identity))


ANSWERS: dict[str, Callable[[RawPeer], None]] = {
    "closed at once": lambda peer: peer.close(),
    "reset at once": lambda peer: peer.reset(),
    "a web server": raw(b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n"),
    "random bytes": raw(os.urandom(65536)),
    "a header that announces 4 GiB": raw(Message(REPLY, 0, 0, 8, bytes(100)).pack(size=2**32 - 1)),
    "half a header": lambda peer: (peer.receive(), peer.send(MAGIC), peer.close()),
    "an empty answer": login(b""),
    "an empty map": login(bytes(4)),
    "a map of four billion": login(MANY),
    "dynamics without end": login(struct.pack("<I", 1) + text("__qi_auth_state") + NESTED),
    "a state that is text": login(struct.pack("<I", 1) + text("__qi_auth_state") + dynamic("s", text("three"))),
    "state 99": login(struct.pack("<I", 1) + text("__qi_auth_state") + dynamic("I", struct.pack("<I", 99))),
    "state 1 for ever": state_one_for_ever,
    "state 2 for ever": state_two_for_ever,
    "refused with a megabyte": login(dynamic("s", text("no\x1b[2J " * 100_000)), kind=ERROR),
    "refused with no text": login(b"\xff" * 10, kind=ERROR),
    "cancelled": login(b"", kind=CANCELED),
    "an event": login(bytes(4), kind=EVENT),
    "capabilities of a megabyte": login(
        struct.pack("<I", 40_000) + b"".join(text(f"capability {n:010}") + dynamic("b", b"\1") for n in range(40_000)),
        kind=CAPABILITY,
    ),
}


@pytest.mark.parametrize("talk", ANSWERS.values(), ids=ANSWERS)
def test_the_login_is_answered_with(talk: Callable[[RawPeer], None]) -> None:
    with Impostor(talk) as impostor:
        try_to_connect(impostor.url)


def test_a_server_that_never_answers() -> None:
    """The wait for the login ends by itself, and can be ended earlier."""
    with Impostor(lambda peer: peer.gone() and None) as impostor:
        session = naoqi.Session()
        begin = time.monotonic()
        future = session.connect(impostor.url, timeout=1.0, _async=True)
        with pytest.raises(RuntimeError):
            future.value(50)
        session.close()
        future.wait(MS)
        assert not future.isRunning() and time.monotonic() - begin < MS / 1e3


# --- a conversation that ends anywhere, or is changed ----------------------------------------------------------------


def converse(url: str) -> None:
    """Everything that a driver does; what fails must say so by RuntimeError, in time."""
    session = naoqi.Session()
    with contextlib.suppress(RuntimeError, AttributeError):
        session.connect(url, _async=True).value(MS)
        robot = session.service("Conversation", _async=True).value(MS)
        link = robot.counted.connect(lambda *_: None)
        robot.count(0, 3, _async=True).value(MS)
        robot.level.setValue(2.5)
        robot.level.value()
        subscriber = robot.subscriber("x", _async=True).value(MS)
        subscriber.signal.connect(lambda *_: None)
        subscriber.raiseEvent(1, _async=True).value(MS)
        robot.later(1, _async=True).value(MS)
        session.services(_async=True).value(MS)
        robot.counted.disconnect(link)
    session.close()


def test_a_conversation_ends_after_and_inside_every_message(honest: ServerProcess) -> None:
    with Between(honest.port, lambda message, _: message.pack()) as whole:
        converse(whole.url)
    assert whole.passed > 12

    def cut(after: int, length: int | None) -> Callable[[Message, int], bytes]:
        return lambda message, number: message.pack()[: length if number == after else None]

    for after in range(whole.passed):
        with Between(honest.port, cut(after, (None, 1, HEADER.size, -1)[after % 4]), last=after) as between:
            begin = time.monotonic()
            converse(between.url)
            assert time.monotonic() - begin < MS / 1e3


LIES: dict[str, Callable[[Message], bytes]] = {
    "an empty payload": lambda m: m._replace(payload=b"").pack(),
    "half a payload": lambda m: m._replace(payload=m.payload[: len(m.payload) // 2]).pack(),
    "ones": lambda m: m._replace(payload=b"\xff" * len(m.payload)).pack(),
    "zeros": lambda m: m._replace(payload=bytes(len(m.payload))).pack(),
    "random bytes": lambda m: m._replace(payload=os.urandom(len(m.payload))).pack(),
    "an error of strange bytes": lambda m: m._replace(kind=ERROR, payload=b"\xff" * 50).pack(),
    "an error without end": lambda m: m._replace(kind=ERROR, payload=NESTED).pack(),
    "another kind": lambda m: m._replace(kind=9).pack() + m._replace(kind=CANCELED, payload=b"").pack(),
    "one dynamic of strange bytes": lambda m: m._replace(flags=1, payload=b"\xff" * 50).pack(),
    "one dynamic without end": lambda m: m._replace(flags=1, payload=NESTED).pack(),
    "a signature of a megabyte": lambda m: m._replace(flags=1, payload=text("[" * MEGABYTE)).pack(),
    "answered twice": lambda m: m.pack() * 2,
    "answered to somebody else": lambda m: m._replace(identity=m.identity ^ 1 << 30).pack()
    + m._replace(kind=CANCELED, payload=b"").pack(),
    "ten thousand events of nobody": lambda m: Message(EVENT, 2, 1, 999, b"\xff" * 20).pack() * 10_000 + m.pack(),
    "calls of what is not there": lambda m: Message(CALL, 99, 1, 100, b"\xff" * 20).pack() * 1000 + m.pack(),
    "posts of what is not there": lambda m: Message(POST, 99, 1, 100, b"\xff" * 20).pack() * 1000 + m.pack(),
}


@pytest.mark.parametrize("lie", LIES.values(), ids=LIES)
def test_every_answer_is_a_lie_in_turn(honest: ServerProcess, lie: Callable[[Message], bytes]) -> None:
    """One answer of a conversation after the other is changed; only the login is honest."""
    for place in (1, 5, 8, 10):

        def change(message: Message, number: int, place: int = place) -> bytes:
            return lie(message) if number == place else message.pack()

        with Between(honest.port, change) as between:
            begin = time.monotonic()
            converse(between.url)
            assert time.monotonic() - begin < 2 * MS / 1e3


def metaobject(members: int, signature: str, name: str = "f") -> bytes:
    """Return the metaobject of a service that has this many methods of this signature."""
    methods = b"".join(
        struct.pack("<II", 100 + n, 100 + n) + text("v") + text(f"{name}{n}") + text(signature) + text("")
        + struct.pack("<I", 0) + text("")
        for n in range(members)
    )  # fmt: skip
    return struct.pack("<I", members) + methods + bytes(8) + text("")


METAOBJECTS = {
    "none": b"",
    "four billion methods": MANY,
    "ten thousand methods": metaobject(10_000, "(m)"),
    "ten thousand overloads": metaobject(10_000, "(m)", "f")[:-4] + text(""),
    "a signature that does not close": metaobject(1, "(((("),
    "a signature without end": metaobject(1, "[" * 50_000),
    "a signature of a megabyte": metaobject(1, "(" + "m" * MEGABYTE + ")"),
    "an empty signature": metaobject(1, ""),
    "no name": metaobject(3, "(m)", ""),
    "a name that Python has": metaobject(1, "(m)", "__class__"),
    "a name of control characters": metaobject(1, "(m)", "\x1b[2J"),
}


@pytest.mark.parametrize("described", METAOBJECTS.values(), ids=METAOBJECTS)
def test_a_service_describes_itself_as(honest: ServerProcess, described: bytes) -> None:
    def change(message: Message, number: int) -> bytes:
        ours = message.kind == REPLY and message.service > 1 and message.action == 2
        return (message._replace(payload=described) if ours else message).pack()

    with Between(honest.port, change) as between:
        session = naoqi.Session()
        session.connect(between.url)
        with contextlib.suppress(RuntimeError):
            service = session.service("Conversation", _async=True).value(MS)
            for name in ("f0", "__class__0", "never"):
                with contextlib.suppress(RuntimeError, AttributeError):
                    service.call(name, 1, _async=True).value(100)
        session.close()


# --- a server that stops reading, or never stops talking -------------------------------------------------------------


class Deaf:
    """An honest server in front of which somebody stops reading what the client says."""

    def __init__(self, honest: ServerProcess) -> None:
        self._stopped = threading.Event()
        self._end = threading.Event()
        self._port = honest.port
        self._impostor = Impostor(self._talk)
        self.url = self._impostor.url

    def stop(self) -> None:
        self._stopped.set()

    def _talk(self, client: RawPeer) -> None:
        with RawPeer(("127.0.0.1", self._port)) as server:
            threading.Thread(target=forward, args=(server, client), name="deaf", daemon=True).start()
            while not self._stopped.is_set():
                server.send(client.receive())
            self._end.wait(60.0)

    def __enter__(self) -> Deaf:
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._impostor.__exit__()


def test_a_server_that_stops_reading(honest: ServerProcess) -> None:
    """200 MB are posted to it: no caller waits, and memory is bounded."""
    with Deaf(honest) as deaf:
        session = naoqi.Session()
        session.connect(deaf.url)
        service = session.service("Conversation")
        deaf.stop()
        before, begin = used()[0], time.monotonic()
        blob = bytes(MEGABYTE)
        with contextlib.suppress(RuntimeError):
            for _ in range(200):
                service.post("size", blob)
        assert time.monotonic() - begin < MS / 1e3
        assert used()[0] < before + 100.0
        late = service.later(1, _async=True)
        with pytest.raises(RuntimeError):
            late.value(200)
        session.close()


def test_a_flood_of_events_that_the_client_asked_for(honest: ServerProcess) -> None:
    """A handler that is slow costs neither memory without end nor the answers to calls."""
    session = naoqi.Session()
    session.connect(honest.url)
    service = session.service("Conversation")
    heard = threading.Semaphore(0)
    enough = threading.Event()

    def slow(_value: Any) -> None:
        heard.release()
        enough.wait(0.02)

    service.anything.connect(slow)
    before = used()[0]
    blob = bytes(256 * 1024)
    other = naoqi.Session()
    other.connect(honest.url)
    speaker = other.service("Conversation")
    for _ in range(300):
        speaker.emit(blob)
    assert service.later(1, _async=True).value(MS) == 1
    assert heard.acquire(timeout=MS / 1e3)
    assert used()[0] < before + 120.0
    enough.set()
    session.close()
    other.close()
