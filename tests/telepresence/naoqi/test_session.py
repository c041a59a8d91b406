"""A session's life: what its user sees when connections, services and objects come and go."""

from __future__ import annotations

import contextlib
import gc
import queue
import socket
import ssl
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tcp_listener import TcpListener
from tls_front import make_certificate
from waiting import wait_until

import telepresence.naoqi as ours
from telepresence.naoqi import directory_link, remote_signal
from telepresence.naoqi.connection import Connection
from telepresence.naoqi.message import REPLY
from telepresence.naoqi.python_object import served
from telepresence.naoqi.remote_object import RemoteObject, Reply, arity
from telepresence.naoqi.routing import candidates, stays

PATIENCE = 20.0
MS = int(PATIENCE * 1000)


class Child:
    def __init__(self) -> None:
        self.signal = ours.Signal("(m)")

    def answer(self) -> int:
        return 42


class Parent:
    def __init__(self) -> None:
        self.told = ours.Signal("(i)")
        self.children: list[Child] = []
        self.release = threading.Event()

    def wait(self) -> str:
        self.release.wait(PATIENCE)
        return "released"

    def tell(self, count: int) -> None:
        for number in range(count):
            self.told(number)

    def child(self) -> Child:
        self.children.append(Child())
        return self.children[-1]

    def emit_child(self, value: Any) -> None:
        self.children[-1].signal(value)

    def echo(self, value: Any) -> Any:
        return value


ours.multiThreaded()(Parent)


class Robot:
    """A server of ours with one service of each kind."""

    def __init__(self, **options: Any) -> None:
        self.server = ours.Server(options.pop("url", "tcp://127.0.0.1:0"), **options)
        self.parent = Parent()
        self.number = self.server.register("Parent", served(self.parent))
        self.server.start()
        self.url = self.server.endpoints[0]

    def hosted(self) -> int:
        """Return how many objects clients hold by reference."""
        return sum(len(connection.references.hosted) for connection in list(self.server._connections))

    def close(self) -> None:
        self.parent.release.set()
        self.server.close()


@pytest.fixture
def robot() -> Iterator[Robot]:
    robot = Robot()
    yield robot
    robot.close()


@pytest.fixture
def session(robot: Robot) -> Iterator[ours.Session]:
    session = ours.Session()
    session.connect(robot.url)
    yield session
    session.close()


def error_of(function: Callable[[], Any]) -> str:
    with pytest.raises(RuntimeError) as raised:
        function()
    return str(raised.value).splitlines()[0]


def is_unknown(session: Any, name: str) -> bool:
    """libqi may forget a service on another thread than the one that tells of its end."""
    with contextlib.suppress(RuntimeError):
        session.service(name)
        return False
    return True


# --- what a client sees, by both packages -----------------------------------------------------------------------------


def test_before_and_after_a_connection(qi: Any, robot: Robot) -> None:
    session = qi.Session()
    events: queue.Queue = queue.Queue()
    session.connected.connect(lambda *args: events.put(("connected", *args)))
    session.disconnected.connect(lambda *args: events.put(("disconnected", *args)))
    closed = [session.services, lambda: session.service("Parent"), lambda: session.unregisterService(3)]
    for ask in closed:
        assert error_of(ask) == "Session not connected."
    assert error_of(session.url) == "Session disconnected"
    assert not session.isConnected() and session.endpoints() == []
    session.connect(robot.url)
    assert session.isConnected() and session.url() == robot.url
    assert error_of(lambda: session.connect(robot.url)) == "Session is already connected"
    assert events.get(timeout=PATIENCE) == ("connected",)
    parent = session.service("Parent")
    waiting = parent.wait(_async=True)
    session.close()
    assert waiting.error(MS) == "Session closed"
    assert error_of(lambda: parent.echo(1)) == parent.echo(1, _async=True).error(MS) == "Socket is not connected"
    event, reason = events.get(timeout=PATIENCE)
    # libqi gives now the one, now the other reason.
    assert event == "disconnected" and reason in ("disconnected", "User closed the connection" * (qi is not ours))
    for ask in closed:
        assert error_of(ask) == "Session not connected."
    session.connect(robot.url)  # the same session again; what was fetched before stays dead
    assert session.service("Parent").echo(1) == 1
    assert error_of(lambda: parent.echo(1)) == "Socket is not connected"
    session.close()
    session.close()  # does no harm


def test_the_server_goes(qi: Any, robot: Robot) -> None:
    session = qi.Session()
    lost = threading.Event()
    session.disconnected.connect(lambda reason: lost.set())
    session.connect(robot.url)
    parent = session.service("Parent")
    waiting = parent.wait(_async=True)
    robot.server.close()
    assert waiting.error(MS) == "Session closed" and lost.wait(PATIENCE)
    assert error_of(lambda: parent.echo(1)) == "Socket is not connected"
    wait_until(lambda: not session.isConnected(), "it knows")
    assert error_of(lambda: session.service("Parent")) == "Session not connected."
    assert error_of(lambda: session.connect(robot.url)).startswith("Connect error: 111: Connection refused")
    session.close()


def test_a_service_goes(qi: Any, robot: Robot) -> None:
    session = qi.Session()
    session.connect(robot.url)
    gone: queue.Queue = queue.Queue()
    session.serviceUnregistered.connect(lambda number, name: gone.put((number, name)))
    parent = session.service("Parent")
    waiting = parent.wait(_async=True)
    wait_until(lambda: parent.echo(1), "the call before this has been begun")
    robot.server.unregister(robot.number)
    assert waiting.error(MS) == "Service removed"
    assert gone.get(timeout=PATIENCE) == (robot.number, "Parent")
    assert error_of(lambda: parent.echo(1)) == "Socket is not connected"
    wait_until(lambda: is_unknown(session, "Parent"), "the session has forgotten the service")
    assert error_of(lambda: session.service("Parent")) == "Cannot find service 'Parent' in index"
    session.close()


def test_a_service_of_ones_own_is_called_directly(qi: Any, robot: Robot) -> None:
    session = qi.Session()
    session.connect(robot.url)
    child = Child() if qi is ours else _vendors_child(qi)
    number = session.registerService("Mine", child)
    assert session.service("Mine").answer() == 42
    session.unregisterService(number)
    assert error_of(lambda: session.service("Mine")) == "Cannot find service 'Mine' in index"
    session.close()


def _vendors_child(qi: Any) -> Any:
    class Mine:
        def answer(self) -> int:
            return 42

    return Mine()


def test_a_session_that_nobody_holds_closes(qi: Any, robot: Robot) -> None:
    def parent_of_a_session() -> Any:
        session = qi.Session()
        session.connect(robot.url)
        assert session.service("Parent").echo(1) == 1
        return session.service("Parent")

    parent = parent_of_a_session()
    gc.collect()
    wait_until(lambda: parent.echo(1, _async=True).hasError(MS), "its proxies are dead")
    assert error_of(lambda: parent.echo(1)) == "Socket is not connected"
    wait_until(lambda: not robot.server._connections, "and its connection is closed")


# --- waits have an end ------------------------------------------------------------------------------------------------


def test_a_peer_that_never_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    listener = TcpListener(lambda stream: stream.recv(1 << 16) and threading.Event().wait(0.5))
    session = ours.Session()
    began = time.monotonic()
    with pytest.raises(RuntimeError, match="does not answer"):
        session.connect(f"tcp://127.0.0.1:{listener.port}", timeout=0.1)
    assert time.monotonic() - began < PATIENCE and not session.isConnected()
    listener.close()


def test_a_directory_that_never_answers(robot: Robot, session: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(directory_link, "ANSWER_S", 0.1)
    monkeypatch.setattr(RemoteObject, "start", lambda *_: ours.Future())
    with pytest.raises(RuntimeError, match=r"directory does not answer services within 0\.1 s"):
        session.services()


def test_waiting_for_a_service(robot: Robot, session: Any) -> None:
    assert session.waitForService("Parent") is None
    waiting = session.waitForService("Late", _async=True)
    assert waiting.isRunning()
    robot.server.register("Late", ours.ServedObject())
    assert waiting.value(MS) is None
    with pytest.raises(RuntimeError, match="timeout"):
        session.waitForService("Never", timeout=10)
    waiting = session.waitForService("Never", _async=True)
    session.close()
    assert waiting.error(MS) == "Session closed"


# --- signals and objects ----------------------------------------------------------------------------------------------


def test_subscribers_of_one_signal_share_one_registration(robot: Robot, session: Any) -> None:
    links = served(robot.parent)._links
    first, second = session.service("Parent"), session.service("Parent")
    seen: queue.Queue = queue.Queue()
    ids = [first.told.connect(lambda n: seen.put(("first", n))), second.told.connect(lambda n: seen.put(("second", n)))]
    assert [len(one) for one in links.values()] == [1]
    first.tell(1)
    assert {seen.get(timeout=PATIENCE) for _ in range(2)} == {("first", 0), ("second", 0)}
    first.told.disconnect(ids[0])
    first.tell(1)
    assert seen.get(timeout=PATIENCE) == ("second", 0) and seen.empty()
    second.told.disconnectAll()
    assert [len(one) for one in links.values()] == [0]
    with pytest.raises(RuntimeError, match=r"Cannot find local signal connection\."):
        second.told.disconnect(ids[1])


def test_a_slow_subscriber_holds_nobody_up_and_loses_what_is_too_much(
    session: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(remote_signal, "MAX_WAITING_EVENTS", 50)
    parent = session.service("Parent")
    go, slow, quick = threading.Event(), [], []
    parent.told.connect(lambda n: (go.wait(PATIENCE), slow.append(n)))
    parent.told.connect(quick.append)
    parent.tell(500)
    assert parent.echo(1) == 1
    assert wait_until(lambda: len(quick) >= 51 and quick, "the quick one has events")[:51] == list(range(51))
    go.set()
    wait_until(lambda: len(slow) == len(quick), "the slow one gets the same")
    assert slow == quick and len(slow) < 500
    parent.tell(1)
    wait_until(lambda: slow[-1:] == [0], "and goes on with what comes later")


def test_a_passed_object_is_released_with_its_last_use(robot: Robot, session: Any) -> None:
    parent = session.service("Parent")
    child = parent.child()
    assert child.answer() == 42 and robot.hosted() == 1
    del child
    wait_until(lambda: robot.hosted() == 0, "the robot is told")
    signal = parent.child().signal  # nobody holds the proxy itself
    gc.collect()
    seen: queue.Queue = queue.Queue()
    signal.connect(seen.put)
    robot.parent.emit_child("still here")
    assert seen.get(timeout=PATIENCE) == "still here" and robot.hosted() == 1
    del signal
    wait_until(lambda: robot.hosted() == 0, "the robot is told")


def test_an_object_that_nobody_asks_for_is_released_too(robot: Robot, session: Any) -> None:
    future = session.service("Parent").child(_async=True)
    assert future.wait(MS) == ours.FutureState.FinishedWithValue
    del future
    wait_until(lambda: robot.hosted() == 0, "the robot is told")


def test_replies_are_decoded_by_who_waits(session: Any) -> None:
    reply = Reply(session.service("Parent")._remote, "i")
    reply.done(REPLY, 0, b"\1")  # as the reader of the network does: it must not fail
    assert error_of(reply.value)
    assert reply.hasError() and session.service("Parent").echo(1) == 1


# --- callbacks --------------------------------------------------------------------------------------------------------


def test_callbacks_may_call_and_close(robot: Robot) -> None:
    session = ours.Session()
    session.connect(robot.url)
    parent = session.service("Parent")
    seen: queue.Queue = queue.Queue()

    def callback(number: int) -> None:
        seen.put(parent.echo(number + 1))
        session.close()
        seen.put("closed")

    session.disconnected.connect(lambda reason: (session.close(), seen.put(reason)))
    parent.told.connect(callback)
    parent.tell(1, _async=True)
    assert seen.get(timeout=PATIENCE) == 1
    assert {seen.get(timeout=PATIENCE) for _ in range(2)} == {"closed", "disconnected"}
    assert not session.isConnected()


def test_calls_and_callbacks_of_one_object_run_one_at_a_time(robot: Robot, session: Any) -> None:
    running, most = [], []

    @ours.singleThreaded()
    class Careful:
        def work(self, *_: Any) -> None:
            running.append(1)
            most.append(len(running))
            time.sleep(0.002)
            running.pop()

    careful = Careful()
    parent = session.service("Parent")
    parent.told.connect(careful.work)
    parent.told.connect(careful.work)
    parent.tell(10)
    wait_until(lambda: len(most) == 20, "all events arrive")
    assert max(most) == 1


# --- ways to a service ------------------------------------------------------------------------------------------------

A, B, OUTER = "tcp://127.0.0.1:9559", "tcp://127.0.0.1:40000", "tcp://192.168.1.10:9559"


@pytest.mark.parametrize(
    ("endpoints", "dialled", "directory", "expected"),
    [
        (["qi:ServiceDirectory", "qi:T", B], A, [A], True),
        ([A], "127.0.0.1", [], True),
        ([A, OUTER], "tcp://10.0.0.1:1234", [OUTER, A], True),  # a robot of 2.5 behind a port forward
        ([B], A, [A, OUTER], False),
        (["qi:T", B], A, ["qi:ServiceDirectory", A], False),
        ([], A, [A], True),  # it does not listen: the directory's process leads to it
        (["qi:T"], A, [A], True),
    ],
)
def test_which_services_are_reached_over_the_first_connection(
    endpoints: list[str], dialled: str, directory: list[str], expected: bool
) -> None:
    assert stays(endpoints, dialled, directory) is expected


@pytest.mark.parametrize(
    ("endpoints", "same", "expected"),
    [
        ([OUTER, A], True, [A]),
        ([OUTER, A], False, [OUTER]),
        ([OUTER], True, [OUTER]),
        ([A], False, [A]),
        (["qi:T", "junk://x", A, A, "tcp://127.0.0.1:0"], True, [A]),
    ],
)
def test_which_addresses_are_tried(endpoints: list[str], same: bool, expected: list[str]) -> None:
    assert candidates(endpoints, same) == expected


def test_one_connection_through_a_port_forward_to_an_old_robot() -> None:
    robot = Robot(release=ours.RELEASES["2.5"])
    target = int(robot.url.rpartition(":")[2])
    opened: list[int] = []

    def forward(near: socket.socket) -> None:
        opened.append(1)
        with near, socket.create_connection(("127.0.0.1", target)) as far:
            ends = {near: far, far: near}

            def pump(source: socket.socket) -> None:
                with contextlib.suppress(OSError):  # at the end either side may be gone or closed first
                    while data := source.recv(1 << 16):
                        ends[source].sendall(data)
                    ends[source].shutdown(socket.SHUT_WR)

            back = threading.Thread(target=pump, args=(far,), daemon=True)
            back.start()
            pump(near)
            back.join(PATIENCE)

    listener = TcpListener(forward)
    session = ours.Session()
    session.connect(f"tcp://127.0.0.1:{listener.port}")
    assert session.service("Parent").child().answer() == 42
    assert opened == [1] and len(robot.server._connections) == 1
    session.close()
    robot.close()
    listener.close()


def test_a_service_that_listens_is_dialled(qi: Any, robot: Robot, session: Any) -> None:
    provider = qi.Session()
    provider.connect(robot.url)
    provider.listen("tcp://127.0.0.1:0")
    child = Child() if qi is ours else _vendors_child(qi)
    provider.registerService("Direct", child)
    direct = session.service("Direct")
    assert direct.answer() == 42
    assert direct._remote.connection is not session.service("Parent")._remote.connection
    assert f"tcp://{direct._remote.connection.peer}" in provider.endpoints()
    waiting = direct.answer(_async=True)
    assert waiting.value(MS) == 42
    provider.close()
    wait_until(lambda: direct.answer(_async=True).hasError(MS), "it is gone")
    session.close()


def test_a_standalone_session_serves_both_packages(qi: Any) -> None:
    standalone = ours.Session()
    standalone.listenStandalone("tcp://127.0.0.1:0")
    number = standalone.registerService("Parent", Parent())
    assert standalone.endpoints()[0] == standalone.url()
    client = qi.Session()
    client.connect(standalone.url())
    parent = client.service("Parent")
    seen: queue.Queue = queue.Queue()
    parent.told.connect(seen.put)
    parent.tell(3)
    assert [seen.get(timeout=PATIENCE) for _ in range(3)] == [0, 1, 2]
    gone: queue.Queue = queue.Queue()
    client.serviceUnregistered.connect(lambda *args: gone.put(args))
    standalone.unregisterService(number)
    assert gone.get(timeout=PATIENCE) == (number, "Parent")
    wait_until(lambda: is_unknown(client, "Parent"), "the client has forgotten the service")
    assert error_of(lambda: client.service("Parent")) == "Cannot find service 'Parent' in index"
    client.close()
    standalone.close()
    assert standalone.endpoints() == [] and not standalone.isConnected()


RECORD = ("T", 2, "machine", 1, [A], "session", b"\xff")


@pytest.mark.parametrize(
    "value",
    [
        ours.Record(zip(directory_link._INFO_FIELDS[:6], RECORD, strict=False), endpoints="tcp://x"),
        ours.Record(name="T", serviceId=2, machineId="machine"),
        ("T", 2, "machine", 1, [A, 3], "session"),
        ("T", "2", "machine", 1, [A], "session"),
        "T",
        None,
    ],
)
def test_a_directory_may_say_anything(value: Any) -> None:
    with pytest.raises(ours.WireError):
        directory_link._info(value)


@pytest.mark.parametrize("fields", [6, 7])
def test_records_without_names_are_read_by_their_order(fields: int) -> None:
    assert directory_link._info(RECORD[:fields])["endpoints"] == [A]


@pytest.mark.parametrize(("parameters", "count"), [("(is)", 2), ("()", 0), ("m", -1), ("i", -2), ("(", -2), ("", -2)])
def test_how_many_arguments_a_robots_method_takes(parameters: str, count: int) -> None:
    assert arity(parameters) == count


# --- logins and TLS ---------------------------------------------------------------------------------------------------


class Factory:
    """What scripts give to setClientAuthenticatorFactory."""

    def __init__(self, user: str, token: str) -> None:
        self.data = {"user": user, "token": token}

    def newAuthenticator(self) -> Factory:
        return self

    def initialAuthData(self) -> dict[str, str]:
        return self.data

    def _processAuth(self, data: dict[str, Any]) -> dict[str, str]:
        return self.data


def _tls(certificate: Path) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate)
    return context


def _pinned(certificate: Path) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.load_verify_locations(certificate)
    return context


def test_a_robot_with_a_password_and_a_known_certificate(tmp_path: Path) -> None:
    mine, other = make_certificate(tmp_path, "mine"), make_certificate(tmp_path, "other")
    robot = Robot(url="tcps://127.0.0.1:0", release=ours.RELEASES["2.9"], login={"nao": "secret"}, tls=_tls(mine))
    session = ours.Session()
    assert "Authentication failed" in error_of(lambda: session.connect(robot.url))
    session.setClientAuthenticatorFactory(Factory("nao", "wrong"))
    assert "Authentication failed" in error_of(lambda: session.connect(robot.url))
    session.setClientAuthenticatorFactory(Factory("nao", "secret"))
    session.connect(robot.url)  # as the vendor's: no certificate is checked
    assert session.service("Parent").child().answer() == 42
    session.close()
    session.connect(robot.url, tls=_pinned(mine))
    assert session.service("Parent").echo("x" * 100_000) == "x" * 100_000
    session.close()
    assert "certificate" in error_of(lambda: session.connect(robot.url, tls=_pinned(other)))
    robot.close()


def test_a_robot_that_asks_again(monkeypatch: pytest.MonkeyPatch) -> None:
    from telepresence.naoqi import Typed
    from telepresence.naoqi.codec import decode, encode
    from telepresence.naoqi.login import ServerLogin

    asked: list[dict[str, Any]] = []

    def authenticate(self: ServerLogin, header: Any, payload: Any) -> None:
        asked.append(decode("{sm}", payload))
        state = {"__qi_auth_state": Typed("I", 2), "auth_newToken": "abc"}
        if len(asked) == 2:
            state = {"__qi_auth_state": Typed("I", 3)}
        self._connection.reply(header, encode("{sm}", state))
        if len(asked) == 2:
            self._admit()

    class Renewing(Factory):
        def _processAuth(self, data: dict[str, Any]) -> dict[str, str]:
            return {"user": "nao", "token": data["newToken"]}

    monkeypatch.setattr(ServerLogin, "_authenticate", authenticate)
    robot, session = Robot(login={"nao": ""}), ours.Session()
    session.setClientAuthenticatorFactory(Renewing("nao", "old"))
    session.connect(robot.url)
    assert session.service("Parent").echo(1) == 1
    assert asked[0]["auth_token"] == "old" and asked[1] == {"auth_user": "nao", "auth_token": "abc"}
    session.close()
    robot.close()


@pytest.mark.parametrize("release", ["2.1", "2.5", "2.8", "libqi 4"])
def test_robots_of_every_release(release: str) -> None:
    robot, session = Robot(release=ours.RELEASES[release]), ours.Session()
    session.connect(robot.url)
    parent = session.service("Parent")
    seen: queue.Queue = queue.Queue()
    parent.told.connect(seen.put)
    parent.tell(1)
    assert seen.get(timeout=PATIENCE) == 0 and parent.child().answer() == 42
    number = session.registerService("Mine", Child())
    assert robot.server.remote("Mine").answer() == 42
    session.unregisterService(number)
    session.close()
    robot.close()


def test_a_connection_has_an_end_of_its_own(session: Any) -> None:
    """A session is told of the end by its connection, not by the next call."""
    connection: Connection = session.service("Parent")._remote.connection
    lost = threading.Event()
    session.disconnected.connect(lambda reason: lost.set())
    connection.close("the network is gone")
    assert lost.wait(PATIENCE) and not session.isConnected()
