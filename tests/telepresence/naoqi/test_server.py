"""Our server by itself: what it does with its sockets, its clients' services, and clients that behave badly."""

from __future__ import annotations

import os
import ssl
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from naoqi_bytes import (
    CALL,
    CANCEL,
    CANCELED,
    CAPABILITY,
    ERROR,
    EVENT,
    LOGIN,
    POST,
    REPLY,
    Closed,
    Message,
    RawPeer,
    dynamic,
    flags,
    members,
    text,
)
from waiting import wait_until

import telepresence.naoqi.server as server_module
from telepresence.naoqi.connection import Connection
from telepresence.naoqi.dial import connect
from telepresence.naoqi.future import Future
from telepresence.naoqi.limits import Limits
from telepresence.naoqi.login import log_in
from telepresence.naoqi.releases import CLIENT_CAPABILITIES, RELEASES
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.server import Server
from telepresence.naoqi.session import Session
from telepresence.naoqi.signals import Signal

PATIENCE = 20.0
MS = int(PATIENCE * 1000)


class Probe(ServedObject):
    """Service 2 of the test's servers, its members from 100 up."""

    def __init__(self) -> None:
        super().__init__()
        self.told = Signal("(s)")
        self.gate = threading.Event()
        self.pending: Future = Future()
        self.add_method("add", "i", "(ii)", lambda one, other: one + other)  # 100
        self.add_method("tell", "v", "(s)", self.told)  # 101
        self.add_method("wait", "b", "()", lambda: self.gate.wait(PATIENCE))  # 102
        self.add_method("later", "m", "()", self._answer_later)  # 103
        self.add_method("echo", "m", "(m)", lambda value: value)  # 104
        self.add_method("child", "o", "()", ServedObject)  # 105
        self.add_signal("told", self.told)  # 106

    def _answer_later(self) -> Future:
        self.pending = Future(on_cancel=lambda: self.pending.finish_canceled())
        return self.pending


class Robot:
    """A server with a probe."""

    def __init__(self, **options: Any) -> None:
        self.server = Server(**options)
        self.probe = Probe()
        self.server.register("Probe", self.probe)
        self.server.start()
        self.url = self.server.endpoints[0]
        self.address = ("127.0.0.1", int(self.url.rpartition(":")[2]))

    def peer(self) -> RawPeer:
        peer = RawPeer(self.address)
        peer.log_in()
        return peer

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_: object) -> None:
        self.probe.gate.set()
        self.server.close()


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Servers look after their connections often, so that no test waits for it."""
    monkeypatch.setattr(server_module, "_CHECK_S", 0.05)


@pytest.fixture(scope="module")
def robot() -> Iterator[Robot]:
    with Robot() as robot:
        yield robot


@pytest.fixture
def peer(robot: Robot) -> Iterator[RawPeer]:
    with robot.peer() as peer:
        yield peer


def subscribe(peer: RawPeer, link: int = 5, uid: int = 106) -> Message:
    return peer.answer(Message(CALL, 2, 1, 0, struct.pack("<IIQ", 1, uid, link)))


def add(peer: RawPeer) -> int:
    return struct.unpack("<i", peer.answer(Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2))).payload)[0]


# --- listening and closing


def test_closing_leaves_no_descriptor_and_no_thread() -> None:
    others = set(threading.enumerate())
    for _ in range(2):  # the first one starts what stays: the I/O thread
        descriptors = set(os.listdir("/proc/self/fd"))
        with Robot() as robot, robot.peer() as one, robot.peer() as other:
            assert add(one) == add(other) == 3
            robot.server.close()
            with pytest.raises((Closed, ConnectionError)):
                add(one)
    wait_until(lambda: set(os.listdir("/proc/self/fd")) <= descriptors, "descriptors are left")
    names = [thread.name for thread in threading.enumerate() if thread not in others]
    assert not [name for name in names if name.startswith("naoqi") and name not in ("naoqi-reactor", "naoqi-worker")]


def test_a_port_that_is_taken_is_named(robot: Robot) -> None:
    with pytest.raises(OSError, match=rf"cannot listen on {robot.url}: Address already in use; another robot may"):
        Server(robot.url).start()
    for url in ("tcps://127.0.0.1:0", "http://x", "tcp://127.0.0.1:99999"):
        with pytest.raises(OSError, match=r"certificate|Invalid url"):
            Server(url).start()


def test_every_interface_is_listed() -> None:
    with Robot(url="tcp://0.0.0.0:0") as robot, robot.peer() as peer:
        port = robot.address[1]
        assert f"tcp://127.0.0.1:{port}" in robot.server.endpoints and "tcp://0.0.0.0" not in str(
            robot.server.endpoints
        )
        listed = peer.answer(Message(CALL, 1, 1, 100, text("Probe"))).payload
        assert b"qi:ServiceDirectory" in listed and f"tcp://127.0.0.1:{port}".encode() in listed


# --- the login


@pytest.mark.parametrize("version", ["2.1", "2.5"])
def test_an_old_robot_serves_whoever_calls(version: str) -> None:
    with Robot(release=RELEASES[version]) as robot:
        with RawPeer(robot.address) as peer:
            peer.send(Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2)))
            assert b"MetaObjectCache" in peer.next(CAPABILITY).payload and peer.next().payload == struct.pack("<i", 3)
        with RawPeer(robot.address) as peer:
            assert peer.answer(LOGIN).kind == (ERROR if version == "2.1" else REPLY)
        connection = connect(robot.url, capabilities=CLIENT_CAPABILITIES)
        log_in(connection)
        assert connection.shared("MetaObjectCache") and not connection.shared("ObjectPtrUID")
        connection.close()


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> ssl.SSLContext:
    folder = tmp_path_factory.mktemp("tls")
    kind = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1"
    command = f"openssl req -x509 {kind} -nodes -keyout key.pem -out crt.pem -days 2 -subj /CN=robot"
    subprocess.run(command.split(), cwd=folder, check=True, capture_output=True)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(folder / "crt.pem", folder / "key.pem")
    return context


class Known:
    def __init__(self, user: str, token: str) -> None:
        self.data = {"user": user, "token": token}

    def initialAuthData(self) -> dict[str, str]:
        return self.data

    def _processAuth(self, _data: Any) -> dict[str, str]:
        return self.data


def test_tls_and_a_password(certificate: ssl.SSLContext) -> None:
    """And one who says nothing, and one who talks of something else, hold nobody up."""
    options: dict[str, Any] = {"url": "tcps://127.0.0.1:0", "tls": certificate, "login": {"nao": "secret"}}
    with Robot(release=RELEASES["2.9"], limits=Limits(login_s=1.0), **options) as robot:
        silent, wrong = RawPeer(robot.address), RawPeer(robot.address)
        wrong.send(b"GET / HTTP/1.0\r\n\r\n")
        assert wrong.gone()
        for authenticator in (Known("nao", "wrong"), Known("", "secret"), None):
            connection = connect(robot.url, capabilities=CLIENT_CAPABILITIES)
            with pytest.raises(RuntimeError, match="Authentication failed: wrong user or password"):
                log_in(connection, authenticator)
            assert connection.closed
        connection = connect(robot.url, capabilities=CLIENT_CAPABILITIES)
        log_in(connection, Known("nao", "secret"))
        picture = os.urandom(3_000_000)
        body = dynamic("r", text(picture))
        results: list[Any] = []
        for _ in range(3):
            connection.start_call(2, 1, 104, [body], 0, lambda kind, _, payload: results.append((kind, bytes(payload))))
        wait_until(lambda: len(results) == 3, "no answers over TLS")
        assert results == [(REPLY, body)] * 3
        connection.close()
        assert silent.gone(), "a connection without a login stays"


def test_a_connection_without_a_login_ends() -> None:
    with Robot(limits=Limits(login_s=0.1)) as robot, RawPeer(robot.address) as silent, RawPeer(robot.address) as slow:
        slow.send(LOGIN.pack()[:30])
        with robot.peer() as peer:
            assert silent.gone() and slow.gone() and add(peer) == 3


def test_before_the_login_messages_are_short(robot: Robot) -> None:
    with RawPeer(robot.address) as peer:
        peer.send(LOGIN.pack(size=1_000_000))
        assert peer.gone()


# --- many connections


def test_silent_connections_make_room() -> None:
    with Robot(limits=Limits(connections=5)) as robot:
        with robot.peer() as first:
            silent = [RawPeer(robot.address) for _ in range(20)]
            with robot.peer() as late:
                assert add(first) == add(late) == 3
                assert silent[0].gone()
            for one in silent:
                one.close()
        members_only = [robot.peer() for _ in range(5)]
        with RawPeer(robot.address) as refused:
            assert refused.gone()
        for one in members_only:
            one.close()


SMALL_TABLE = """
import resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))
from telepresence.naoqi.server import Server
server = Server()
server.start()
print(server.endpoints[0], flush=True)
sys.stdin.read()
"""


def test_the_descriptors_are_used_up() -> None:
    """Silent connections take them all: a new client is served all the same, because the oldest make room."""
    root = str(Path(__file__).parents[3])
    with subprocess.Popen(
        [sys.executable, "-c", SMALL_TABLE],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=root,
    ) as process:  # fmt: skip
        assert process.stdout
        address = ("127.0.0.1", int(process.stdout.readline().rpartition(":")[2]))
        silent = [RawPeer(address) for _ in range(100)]
        for _ in range(3):
            with RawPeer(address) as peer:
                peer.log_in()
        for one in silent:
            one.close()
        process.kill()


# --- clients that do not read


def test_events_for_a_client_that_does_not_read_are_dropped(robot: Robot, peer: RawPeer) -> None:
    with Robot(limits=Limits(queue_bytes=300_000)) as robot, robot.peer() as mute, robot.peer() as other:
        assert subscribe(mute).kind == subscribe(other).kind == REPLY
        for number in range(100):
            robot.probe.told(f"{number:03}" + "x" * 100_000)
            assert other.next(EVENT).payload[4:7] == b"%03d" % number
        (stream,) = [one._stream for one in robot.server._connections if one._stream.queued]
        assert stream.dropped and stream.queued < 500_000
        assert add(other) == 3
        mute.send(Message(CALL, 2, 1, 100, struct.pack("<ii", 1, 2)))  # reads again: what was kept comes, in order
        numbers = []
        while (message := mute.receive()).kind == EVENT:
            numbers.append(int(message.payload[4:7]))
        assert numbers == list(range(len(numbers))) and len(numbers) < 100


def test_a_client_that_reads_no_answers_is_cut_off() -> None:
    with (
        Robot(limits=Limits(reply_bytes=2_000_000, stalled_s=1e6)) as robot,
        robot.peer() as mute,
        robot.peer() as peer,
    ):
        request = Message(CALL, 2, 1, 104, dynamic("r", text(bytes(500_000)))).pack()
        with pytest.raises(OSError):
            for _ in range(100):
                mute.send(request)
        assert add(peer) == 3


def test_a_client_that_takes_nothing_for_long_is_cut_off() -> None:
    with Robot(limits=Limits(stalled_s=0.2)) as robot, robot.peer() as mute, robot.peer() as half:
        subscribe(mute)
        for _ in range(100):
            robot.probe.told("x" * 100_000)
        half.send(LOGIN.pack()[:30])
        assert half.gone()
        wait_until(lambda: not robot.server._connections, "a client that reads nothing stays")


def test_blocked_methods_hold_nobody_up(robot: Robot) -> None:
    with robot.peer() as one, robot.peer() as other:
        for number in range(50):
            one.send(Message(CALL, 2, 1, 102, identity=number))
        assert add(other) == 3 and add(one) == 3
        robot.probe.gate.set()
        for _ in range(50):
            assert one.next(REPLY).payload == b"\1"
        robot.probe.gate.clear()


def test_one_client_does_not_take_all_threads() -> None:
    with Robot(limits=Limits(working_calls=3)) as robot, robot.peer() as greedy:
        begun = []
        robot.probe.add_method("block", "v", "()", lambda: (begun.append(1), robot.probe.gate.wait(PATIENCE)))  # 107
        for number in range(20):
            greedy.send(Message(CALL, 2, 1, 107, identity=number))
        (connection,) = robot.server._connections
        wait_until(lambda: len(connection.running) == 20 and len(begun) == 3, "the calls have not come")
        with robot.peer() as other:
            assert add(other) == 3 and len(begun) == 3
        robot.probe.gate.set()
        assert sorted(greedy.next(REPLY).identity for _ in range(20)) == list(range(20))


def test_the_last_word_of_a_client_that_goes_is_obeyed() -> None:
    with Robot() as robot, robot.peer() as peer:
        queue, gate, obeyed = ServedObject(parallel=False), threading.Event(), threading.Event()
        queue.add_method("walk", "v", "()", lambda: gate.wait(PATIENCE) and None)
        queue.add_method("stop", "v", "()", obeyed.set)
        robot.server.register("Legs", queue)
        peer.send(Message(CALL, 3, 1, 100).pack() + Message(POST, 3, 1, 101, identity=2).pack())
        (connection,) = robot.server._connections
        wait_until(lambda: len(connection.running) == 2, "the calls have not come")
        peer.close()
        wait_until(lambda: not robot.server._connections, "the client has not gone")
        gate.set()
        assert obeyed.wait(PATIENCE)


def test_far_too_many_open_calls_are_not_read() -> None:
    with Robot(limits=Limits(pending_calls=10)) as robot, robot.peer() as peer:
        for number in range(200):
            peer.send(Message(CALL, 2, 1, 102, identity=number))
        (connection,) = robot.server._connections
        wait_until(lambda: len(connection.running) > 10, "the calls have not come")
        robot.probe.gate.set()
        answers = [peer.receive() for _ in range(200)]
        refused = [answer for answer in answers if answer.kind == ERROR]
        assert {answer.identity for answer in answers} == set(range(200))
        assert all(b"calls are waiting" in answer.payload for answer in refused)


# --- calls


def test_a_call_that_has_not_begun_is_cancelled_at_once() -> None:
    with Robot() as robot:
        queue = ServedObject(parallel=False)
        gate = threading.Event()
        queue.add_method("wait", "b", "()", lambda: gate.wait(PATIENCE))
        robot.server.register("Queue", queue)
        with robot.peer() as peer:
            peer.send(Message(CALL, 3, 1, 100, identity=7))
            peer.send(Message(CALL, 3, 1, 100, identity=8))
            peer.send(Message(CANCEL, 3, 1, 0, struct.pack("<I", 8), identity=9))
            answer = peer.receive()
            assert (answer.kind, answer.identity) == (CANCELED, 8)
            gate.set()
            answer = peer.receive()
            assert (answer.kind, answer.identity) == (REPLY, 7)


def test_a_link_that_is_registered_twice_is_one(robot: Robot, peer: RawPeer) -> None:
    for _ in range(2):
        assert subscribe(peer, link=9).kind == REPLY
    robot.probe.told("once")
    assert peer.next(EVENT).payload == text("once") and add(peer) == 3
    assert peer.answer(Message(CALL, 2, 1, 1, struct.pack("<IIQ", 1, 106, 9))).kind == REPLY
    refused = peer.answer(Message(CALL, 2, 1, 1, struct.pack("<IIQ", 1, 106, 9)))
    assert refused.kind == ERROR and b"Unregister request failed for 9 1" in refused.payload
    peer.send(Message(POST, 2, 1, 106, text("nobody is there")))
    assert add(peer) == 3


def test_the_limits_of_one_connection() -> None:
    limits = Limits(subscriptions=3, references=4, services=2, capabilities=8)
    with Robot(limits=limits) as robot:
        with robot.peer() as peer:
            assert [subscribe(peer, link).kind for link in (0, 0, 1, 2, 3)] == [REPLY] * 4 + [ERROR]
            assert [peer.answer(Message(CALL, 2, 1, 105)).kind for _ in range(5)] == [REPLY] * 4 + [ERROR]
            assert [register(peer, f"S{number}").kind for number in range(3)] == [REPLY] * 2 + [ERROR]
            assert add(peer) == 3
        with RawPeer(robot.address) as many:
            many.send(Message(CALL, 0, 0, 8, flags(*[(f"capability {number}", True) for number in range(9)])))
            assert many.gone()


# --- the directory


def register(peer: RawPeer, name: str, endpoints: tuple[str, ...] = ("tcp://127.0.0.1:1",)) -> Message:
    listed = struct.pack("<I", len(endpoints)) + b"".join(map(text, endpoints))
    info = text(name) + struct.pack("<I", 0) + text("machine") + struct.pack("<I", 1) + listed + text("s") + text("")
    return peer.answer(Message(CALL, 1, 1, 102, info))


def test_a_service_is_there_when_it_is_ready_and_goes_with_its_owner(robot: Robot) -> None:
    with robot.peer() as watcher:
        owner = robot.peer()
        for number in (106, 107):
            assert watcher.answer(Message(CALL, 1, 1, 0, struct.pack("<IIQ", 1, number, number))).kind == REPLY
        assert owner.answer(Message(CALL, 1, 1, 0, struct.pack("<IIQ", 1, 106, 1))).kind == REPLY
        number = register(owner, "Mine").payload
        assert watcher.answer(Message(CALL, 1, 1, 100, text("Mine"))).kind == ERROR
        assert b"already registered" in register(watcher, "Mine").payload
        assert watcher.answer(Message(CALL, 1, 1, 104, number)).kind == ERROR, "another one's service"
        owner.send(Message(CALL, 1, 1, 104, number))
        assert [owner.receive().kind for _ in range(2)] == [EVENT, REPLY], "the event comes before the answer"
        assert watcher.next(EVENT).payload == number + text("Mine")
        assert b"belongs to somebody else" in watcher.answer(Message(CALL, 1, 1, 103, number)).payload
        assert watcher.answer(Message(CALL, 1, 1, 100, text("Mine"))).kind == REPLY
        owner.close()
        gone = watcher.next(EVENT)
        assert (gone.action, gone.payload) == (107, number + text("Mine"))


class Pet:
    def __init__(self) -> None:
        self.barked = Signal("(s)")

    def bark(self, times: int) -> str:
        self.barked("wuff")
        return "wuff" * times


def test_a_service_of_a_client_that_does_not_listen(robot: Robot) -> None:
    """The server calls it over the client's own connection, and passes the calls of others on."""
    owner, other = Session(), Session()
    owner.connect(robot.url)
    other.connect(robot.url)
    owner.registerService("Pet", Pet())
    assert robot.server.remote("Pet").bark(2) == "wuffwuff"
    pet = other.service("Pet")
    heard: list[str] = []
    pet.barked.connect(heard.append)
    assert pet.bark(3) == "wuffwuffwuff"
    wait_until(lambda: heard == ["wuff"], "the event was not passed on")
    owner.close()
    with pytest.raises(RuntimeError):
        pet.bark(1, _async=True).value(MS)
    with pytest.raises(RuntimeError, match="Cannot find service 'Pet'"):
        robot.server.remote("Pet")
    other.close()


def test_a_client_is_asked_once_what_its_service_offers(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many want to know; each of them waits as long as it likes, and an answer that comes late still counts."""
    monkeypatch.setattr(server_module, "_ASK_S", 0.05)
    with robot.peer() as owner, robot.peer() as other:
        number = register(owner, "Silent").payload
        owner.answer(Message(CALL, 1, 1, 104, number))
        waiting = [robot.server.reach("Silent") for _ in range(5)]
        with pytest.raises(RuntimeError, match=r"service 'Silent' does not describe itself within 0\.05 s"):
            robot.server.remote("Silent")
        asked = owner.next(CALL)
        assert (asked.service, asked.action) == (struct.unpack("<I", number)[0], 2)
        described = other.answer(Message(CALL, 2, 1, 2, bytes(4))).payload
        owner.send(Message(REPLY, asked.service, 1, 2, described, identity=asked.identity))
        assert {one.value(MS) for one in waiting} == {robot.server.reach("Silent").value(MS)}
        owner.answer(Message(CALL, 1, 1, 103, number))
        number = register(owner, "Silent").payload
        owner.answer(Message(CALL, 1, 1, 104, number))
        refused = robot.server.reach("Silent")
        owner.send(Message(ERROR, 0, 0, 0, dynamic("s", text("no")), identity=owner.next(CALL).identity))
        assert "does not describe itself" in refused.error(MS)
        given_up = robot.server.reach("Silent")
        owner.next(CALL)
        owner.answer(Message(CALL, 1, 1, 103, number))
        assert given_up.error(MS) == "service 'Silent' is gone"


# --- references


def dial(robot: Robot) -> Connection:
    connection = connect(robot.url, capabilities=CLIENT_CAPABILITIES)
    log_in(connection)
    return connection


@pytest.mark.parametrize("layout", [(False, False), (False, True), (True, False), (True, True)])
@pytest.mark.parametrize("agreed", [(False, True), (True, False)])
def test_a_reference_in_another_form_than_agreed(robot: Robot, layout: tuple, agreed: tuple) -> None:
    """What NAOqi 2.5's gateway does: it passes on what the service has written for the gateway."""
    connection = dial(robot)
    for number, name in enumerate(("MetaObjectCache", "ObjectPtrUID")):
        connection.local[name] = connection.remote[name] = layout[number]
    written = connection.objects(2).write(robot.probe)
    for number, name in enumerate(("MetaObjectCache", "ObjectPtrUID")):
        connection.local[name] = connection.remote[name] = agreed[number]
    for payload, offset in ((written, 0), (dynamic("o", written), 5)):
        proxy, end = connection.objects(2).read(payload, offset)
        assert end == len(payload) and "told" in dir(proxy)
    connection.close()


def test_an_object_that_was_passed_lives_until_it_is_released(robot: Robot, peer: RawPeer) -> None:
    reference = peer.answer(Message(CALL, 2, 1, 105)).payload
    service, number = struct.unpack_from("<II", reference, len(reference) - 28)
    described = peer.answer(Message(CALL, service, number, 2, bytes(4)))
    assert described.kind == REPLY and "terminate" in members(described.payload)
    peer.send(Message(POST, service, number, 3, struct.pack("<I", service)))
    assert peer.answer(Message(CALL, service, number, 2, bytes(4))).kind == ERROR
    with robot.peer() as stranger:
        assert stranger.answer(Message(CALL, service, number, 2, bytes(4))).kind == ERROR


def test_subscriptions_to_an_object_that_was_passed_end_with_it() -> None:
    """Its own only: not those of another peer, nor of the same peer to the same object under another number."""
    teller, giver, told, subscribe = ServedObject(), ServedObject(), Signal("(s)"), struct.Struct("<IIQ")
    teller.add_signal("told", told)
    giver.add_method("give", "o", "()", lambda: teller)
    with Robot() as robot, robot.peer() as peer, robot.peer() as other:
        assert robot.server.register("Giver", giver) == 3
        given = []
        for one in (peer, peer, other):
            reference = one.answer(Message(CALL, 3, 1, 100)).payload
            service, number = struct.unpack_from("<II", reference, len(reference) - 28)
            one.answer(Message(CALL, service, number, 0, subscribe.pack(number, 100, 1)))
            given.append((service, number))
        (connection,) = [c for c in robot.server._connections if c.peer.endswith(f":{peer.socket.getsockname()[1]}")]
        assert connection.subscribed == {teller: 2}
        service, number = given[0]
        peer.answer(Message(CALL, service, number, 3, struct.pack("<I", service)))
        assert connection.subscribed == {teller: 1}
        told("hello")
        for one, (service, number) in ((peer, given[1]), (other, given[2])):
            event = one.next(EVENT)
            assert (event.service, event.object, event.payload) == (service, number, text("hello"))
