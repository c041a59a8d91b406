"""Targets: both ends of NAOqi's messaging, and what a peer says to them in whole messages."""

from __future__ import annotations

import itertools
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from fuzz_harness import Target


class _AtOnce:
    """Does what workers are to do in the thread that asks for it, so that what fails there is seen."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> None:
        function(*arguments)

    def enter_wait(self) -> None:
        raise AssertionError("a message makes somebody wait")

    leave_wait = enter_wait


@contextmanager
def _no_workers() -> Iterator[None]:
    from telepresence.naoqi import workers

    before = workers._pool
    workers._pool = _AtOnce()  # type: ignore[assignment]
    try:
        yield
    finally:
        workers._pool = before


def _drain(peer: socket.socket) -> int:
    """Read what an end has said; return how many bytes."""
    size = 0
    try:
        while data := peer.recv(1 << 20):
            size += len(data)
    except OSError:
        return size
    return size


def _messages(*messages: tuple[int, int, int, int, int, Sequence[bytes]]) -> bytes:
    """Return a stream of messages (kind, flags, service, object, action, payload), numbered from 1."""
    from telepresence.naoqi.message import Header

    stream = b""
    for identity, (kind, flags, service, number, action, payload) in enumerate(messages, 1):
        data = b"".join(payload)
        stream += Header(identity, len(data), kind, flags, service, number, action).pack() + data
    return stream


def naoqi_server() -> Target:
    """A robot: login, directory, a service with methods, a signal, a property, objects, and a client's own service."""
    from telepresence.naoqi.codec import encode, encode_arguments, encode_dynamic
    from telepresence.naoqi.connection import Connection
    from telepresence.naoqi.dynamics import ROBOT, Typed
    from telepresence.naoqi.future import Promise
    from telepresence.naoqi.limits import Limits
    from telepresence.naoqi.login import ServerLogin
    from telepresence.naoqi.message import CALL, CANCEL, CAPABILITY, POST, MessageReader
    from telepresence.naoqi.releases import CLIENT_CAPABILITIES, RELEASES
    from telepresence.naoqi.served_object import ServedObject
    from telepresence.naoqi.server import Server
    from telepresence.naoqi.signals import Property, Signal
    from telepresence.naoqi.signature import WireError

    release = RELEASES["libqi 4"]
    server = Server("tcp://127.0.0.1:0", release=release)
    robot, part = ServedObject("a robot"), ServedObject("a part")
    part.add_method("name", "s", "()", lambda: "arm", uid=100)
    robot.add_method("add", "i", "(ii)", lambda a, b: a + b, uid=100)
    robot.add_method("echo", "m", "(m)", lambda value: value, uid=101)
    robot.add_method("anything", "m", "m", lambda *values: list(values), uid=102)
    robot.add_method("part", "o", "()", lambda: part, uid=103)
    robot.add_method("wait", "v", "()", lambda: Promise(lambda promise: promise.setCanceled()).future(), uid=104)
    robot.add_method("take", "v", "(o)", lambda value: None, uid=105)
    robot.add_signal("moved", Signal("(is)"), uid=106)
    robot.add_property("volume", Property("f"), uid=107)
    service = server.register("Robot", robot)

    def feed(data: bytes) -> None:
        ours, peer = socket.socketpair()
        with peer:
            ours.setblocking(False)
            peer.setblocking(False)
            connection = Connection(ours, capabilities=release.capabilities, limits=Limits(), dialect=ROBOT)
            connection.lookup = server._lookup
            connection.before_login = ServerLogin(connection, release, None, lambda: None).handle
            said = 0
            try:
                with _no_workers():
                    for header, payload in MessageReader(Limits.payload).feed(data):
                        connection.message(header, payload)
                        said += _drain(peer)
                        if connection.closed:
                            break
                    assert said <= 20_000 * (1 + data.count(b"\x42\xde\xad\x42")), "the answers are much longer"
            finally:
                with _no_workers():
                    connection.close()
                    server._gone(connection)

    info = {"name": "Client", "serviceId": 0, "machineId": "m", "processId": 1, "endpoints": ["tcp://10.0.0.9:1"]}
    info |= {"sessionId": "s", "objectUid": b"\x90" * 20}
    hello = (CALL, 0, 0, 0, 8, encode("{sm}", CLIENT_CAPABILITIES))
    link = encode("(IIL)", (1, 106, 106 << 32 | 13))
    seeds = (
        _messages(hello, (CALL, 0, 1, 1, 2, encode("I", 0)), (CALL, 0, 1, 1, 100, encode("s", "Robot"))),
        _messages(hello, (CALL, 0, service, 1, 100, encode_arguments("(ii)", (1, 2))), (CALL, 0, 1, 1, 101, [])),
        _messages(hello, (CALL, 1, service, 1, 100, encode_dynamic((1, 2.9))), (CALL, 0, service, 1, 103, [])),
        _messages(hello, (CALL, 0, service, 1, 101, encode("m", [1, "a", {"b": (2.5,)}])), (CALL, 0, 1, 1, 108, [])),
        _messages(
            hello,
            (CALL, 2, service, 1, 100, [*encode("(ii)", (1, 2)), *encode("s", "d")]),
            (CALL, 0, service, 1, 104, []),
            (CANCEL, 0, service, 1, 0, encode("I", 3)),
        ),
        _messages(
            hello,
            (CALL, 0, service, 1, 0, link),
            (POST, 0, service, 1, 106, encode("(is)", (3, "hey"))),
            (CALL, 0, service, 1, 1, link),
        ),
        _messages(
            hello,
            (CALL, 0, service, 1, 8, [*link, *encode("s", "(ms)")]),
            (CALL, 0, service, 1, 6, encode("(mm)", (Typed("I", 107), 2.5))),
            (CALL, 0, service, 1, 5, encode("m", "volume")),
            (CALL, 0, service, 1, 7, []),
        ),
        _messages(
            hello,
            (CALL, 0, 1, 1, 0, encode("(IIL)", (1, 106, 5))),
            (CALL, 0, 1, 1, 102, encode(release.service_info_signature, info)),
            (CALL, 0, 1, 1, 104, encode("I", 3)),
        ),
        _messages(
            (CAPABILITY, 0, 0, 0, 0, encode("{sm}", {"MessageFlags": True})), (CALL, 0, service, 1, 2, [bytes(4)])
        ),
        _messages(hello, (POST, 0, service, 3, 3, encode("I", 2)), (CALL, 1, service, 1, 102, encode("m", (1, 2)))),
    )
    return Target(feed, seeds, (WireError,), 3000)


def naoqi_client() -> Target:
    """A client whose calls wait for answers and that has subscribed to a signal; calls to it; references."""
    from telepresence.naoqi.codec import encode
    from telepresence.naoqi.connection import Connection
    from telepresence.naoqi.dynamics import PYTHON
    from telepresence.naoqi.limits import Limits
    from telepresence.naoqi.message import CALL, CANCELED, CAPABILITY, ERROR, EVENT, REPLY, MessageReader
    from telepresence.naoqi.metaobject import BUILT_IN, METAOBJECT, MetaMethod, MetaObject, MetaSignal
    from telepresence.naoqi.releases import CLIENT_CAPABILITIES
    from telepresence.naoqi.remote_object import RemoteObject
    from telepresence.naoqi.remote_signal import RemoteSignal
    from telepresence.naoqi.served_object import ServedObject
    from telepresence.naoqi.signature import WireError

    methods = [
        MetaMethod(100, "i", "add", "(ii)"),
        MetaMethod(101, "m", "echo", "(m)"),
        MetaMethod(102, METAOBJECT, "describe", "()"),
        MetaMethod(103, "o", "part", "()"),
    ]
    meta = MetaObject({method.uid: method for method in methods}, {106: MetaSignal(106, "moved", "(is)")})
    callback = ServedObject("a client")
    callback.add_method("processRemote", "v", "(iimm)", lambda *values: None, uid=100)
    values = (encode("(ii)", (1, 2)), encode("m", [1, "a"]), [], [])

    def feed(data: bytes) -> None:
        ours, peer = socket.socketpair()
        with peer:
            ours.setblocking(False)
            peer.setblocking(False)
            limits = Limits()
            connection = Connection(ours, capabilities=CLIENT_CAPABILITIES, limits=limits, dialect=PYTHON, dialled=True)
            connection.lookup = lambda service, number: callback if (service, number) == (3, 1) else None
            connection.learn({"ObjectPtrUID": True, "MessageFlags": True, "RemoteCancelableCalls": True})
            connection._identities = itertools.count(1)
            remote = RemoteObject(connection, 2, 1, meta)
            try:
                with _no_workers():
                    replies = [
                        remote.start(method.uid, payload, method.returns)
                        for method, payload in zip(methods, values, strict=True)
                    ]
                    events: list[tuple] = []
                    RemoteSignal(remote, 106, "moved", "(is)").connect(lambda *some: events.append(some), _async=True)
                    for header, payload in MessageReader(limits.payload).feed(data):
                        connection.message(header, payload)
                        _drain(peer)
                        if connection.closed:
                            break
                    for reply in replies:
                        if not reply.isFinished():
                            continue
                        if reply.hasValue(0):
                            try:
                                reply.value(0)
                            except WireError:
                                pass
                        elif reply.hasError(0):
                            assert isinstance(reply.error(0), str)
            finally:
                with _no_workers():
                    connection.close()

    part = [*encode(METAOBJECT, MetaObject(dict(BUILT_IN)).to_value()), b"\2\0\0\0\3\0\0\0", bytes(20)]
    seeds = (
        _messages(
            (REPLY, 0, 2, 1, 100, encode("i", 3)),
            (REPLY, 0, 2, 1, 101, encode("m", [1, "a", {"b": 2.5}])),
            (REPLY, 0, 2, 1, 102, encode(METAOBJECT, meta.to_value())),
            (REPLY, 0, 2, 1, 103, part),
            (REPLY, 0, 2, 1, 0, encode("L", 1)),
            (EVENT, 0, 2, 1, 106, encode("(is)", (3, "hey"))),
            (EVENT, 1, 2, 1, 106, encode("m", (3, "hey"))),
        ),
        _messages(
            (ERROR, 0, 2, 1, 100, encode("m", "no")),
            (REPLY, 1, 2, 1, 101, encode("m", 3.0)),
            (CANCELED, 0, 2, 1, 102, []),
            (REPLY, 1, 2, 1, 103, [b"\1\0\0\0o", *part]),
            (CAPABILITY, 0, 0, 0, 0, encode("{sm}", {"MetaObjectCache": True})),
        ),
        _messages(
            (CALL, 0, 3, 1, 2, encode("I", 0)),
            (CALL, 0, 3, 1, 100, encode("(iimm)", (4, 170, [1, 2], b"\0\1" * 100))),
        ),
    )
    return Target(feed, seeds, (WireError,), 4000)
