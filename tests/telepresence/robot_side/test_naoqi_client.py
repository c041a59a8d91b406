"""The client that programs on the robot use, against the vendor's server, and against sockets that do not behave."""

from __future__ import annotations

import contextlib
import importlib.util
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import qi
from python2_syntax import assert_python_2

from telepresence.robot_side import naoqi_connection
from telepresence.robot_side.naoqi_client import Client, NaoqiError, place_of
from telepresence.robot_side.naoqi_values import decode, encode, error_text, parse

HEADER = struct.Struct("<IIIHBBIII")
MAGIC, CALL, REPLY, ERROR, POST, CAPABILITY = 0x42ADDE42, 1, 2, 3, 4, 6
IN = encode(parse("{sm}"), {"__qi_auth_state": 3})


class Motion:
    def __init__(self) -> None:
        self.posted = threading.Event()
        self.promise = qi.Promise()

    def move(self, x: float, y: float, theta: float) -> float:
        return x + y + theta

    def anything(self, *arguments: Any) -> list:
        return list(arguments)

    def refuse(self) -> None:
        raise ValueError("legs are folded")

    def never(self) -> qi.Future:
        return self.promise.future()

    @qi.bind(qi.Int32, (qi.Int32, qi.Float, qi.String))
    def typed(self, count: int, speed: float, name: str) -> int:
        return count

    def note(self) -> None:
        self.posted.set()


@pytest.fixture(scope="module")
def robot() -> Iterator[tuple[str, Motion]]:
    """A directory with ALMotion, and a program of its own with ALTabletService."""
    motion, session, other = Motion(), qi.Session(), qi.Session()
    session.listenStandalone("tcp://127.0.0.1:0")
    session.registerService("ALMotion", motion)
    (url,) = session.endpoints()
    other.connect(url)
    other.listen("tcp://127.0.0.1:0")
    other.registerService("ALTabletService", Motion())
    yield url, motion
    other.close()
    session.close()


@pytest.fixture
def client(robot) -> Iterator[Client]:
    made = Client(robot[0])
    yield made
    made.close()
    assert not any(thread.name == "naoqi-reader" for thread in threading.enumerate()), "its threads end with it"


def test_it_keeps_to_python_2() -> None:
    for module in ("naoqi_client", "naoqi_connection", "naoqi_values"):
        spec = importlib.util.find_spec(f"telepresence.robot_side.{module}")
        assert_python_2(Path(spec.origin))


def test_calls_of_every_kind(client, robot) -> None:
    motion = client.service("ALMotion")
    assert motion.ask("move", 0.25, 0, -1.5) == -1.25
    assert motion.ask("typed", 7, 1, "x") == 7
    assert motion.ask("anything", 1, "Grüße", [2.5, None, True], {"a": [-(2**40)]}) == [
        1, "Grüße", [2.5, None, True], {"a": [-(2**40)]}
    ]  # fmt: skip
    motion.post("note")
    assert robot[1].posted.wait(10)
    answers = [motion.send("move", number, 0, 0) for number in range(20)]
    assert [answer.value(10) for answer in answers] == list(range(20))


def test_refusals_say_why(client) -> None:
    motion = client.service("ALMotion")
    for wrong, said in (
        (lambda: motion.ask("refuse"), "legs are folded"),
        (lambda: motion.ask("fly"), "ALMotion.fly: there is no such method"),
        (lambda: motion.ask("typed", "many", 1, "x"), "'many' is no value of type i"),
        (lambda: motion.ask("typed", 2**40, 1, "x"), "1099511627776 is no value of type i"),
        (lambda: motion.ask("typed", 1), "is no value of type"),
        (lambda: client.service("ALLegs"), "ALLegs"),
    ):
        with pytest.raises(NaoqiError, match=said):
            wrong()
    assert client.connected()


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("\tALProxy::ALProxy\n\tCan't find service: Ears", "ALProxy::ALProxy: Can't find service: Ears"),
        ("ALMotion::setAngles:\n\n  Unknown joint\n  Body.cpp, 12", "ALMotion::setAngles: Unknown joint"),
        ("ALMotion::setAngles", "ALMotion::setAngles"),
        ("ValueError: legs are folded\n\nAt:\n  body.py(3)", "ValueError: legs are folded"),
        ("Cannot find service 'ALLegs' in index", "Cannot find service 'ALLegs' in index"),
        ("  \n ", "NaoqiError"),
        ("x" * 500, "x" * 120),
    ],
)
def test_an_error_of_a_module_of_naoqi_is_told_with_its_reason(text, line) -> None:
    assert error_text(NaoqiError(text)) == line


def test_waiting_for_an_answer_ends(client) -> None:
    answer = client.service("ALMotion").send("never")
    with pytest.raises(NaoqiError, match=r"no answer within 0\.05 s"):
        answer.value(0.05)
    client.wires[0].abort("cut")
    with pytest.raises(NaoqiError, match="never: cut"):
        answer.value(10)
    assert not client.connected() and client.wires[0].waiting() == 0


def test_a_service_of_another_program_gets_a_connection_of_its_own_and_another_one_when_that_ends(client) -> None:
    tablet = client.service("ALTabletService")
    assert tablet.ask("move", 1, 2, 3) == 6 and len(client.wires) == 2
    assert client.service("ALTabletService") is tablet
    tablet.wire.abort()
    assert client.connected()
    assert client.service("ALTabletService").ask("move", 1, 2, 3) == 6 and len(client.wires) == 2


@pytest.mark.parametrize("url", ["pepper", "http://10.0.0.7:80", "tcp://:9559", "tcp://10.0.0.7"])
def test_an_address_that_is_none_is_refused(url) -> None:
    with pytest.raises(ValueError, match="tcp://HOST:9559"):
        place_of(url)


def test_what_is_for_other_machines_is_said(free_port) -> None:
    with pytest.raises(ValueError, match=r"on the robot itself NAOqi answers at tcp://127\.0\.0\.1:9559"):
        Client(f"tcps://127.0.0.1:{free_port()}")
    with pytest.raises(ConnectionRefusedError):
        Client(f"tcp://127.0.0.1:{free_port()}")


class Crooked:
    """A server of one connection that answers as it is told: `script` gets the socket."""

    def __init__(self, script: Callable[[socket.socket], None]) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._script = script
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        with contextlib.suppress(OSError), self._listener:
            self._listener.settimeout(10)
            end, _ = self._listener.accept()
            with end:
                end.settimeout(10)
                self._script(end)
                self._done.wait(10)

    def __enter__(self) -> str:
        return self.url

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()


def receive(end: socket.socket) -> tuple[int, ...]:
    """Kind, id, service, object, action of the next message."""
    head = end.recv(HEADER.size, socket.MSG_WAITALL)
    _, number, size, _, kind, _, service, object_, action = HEADER.unpack(head)
    if size:
        end.recv(size, socket.MSG_WAITALL)
    return kind, number, service, object_, action


def message(kind: int, number: int, payload: bytes, *place: int, flags: int = 0) -> bytes:
    return HEADER.pack(MAGIC, number, len(payload), 0, kind, flags, *(place or (0, 0, 8))) + payload


def let_in(end: socket.socket) -> None:
    end.sendall(message(REPLY, receive(end)[1], IN))


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        (message(REPLY, 1, encode(parse("m"), 7), flags=1), "answers as no NAOqi does"),
        (b"GET / HTTP/1.0\r\n\r\n" + bytes(20), "no message"),
        (HEADER.pack(MAGIC, 1, 2**32 - 1, 0, REPLY, 0, 0, 0, 8), "no message"),
        (HEADER.pack(MAGIC, 1, 0, 1, REPLY, 0, 0, 0, 8), "no message"),
        (message(REPLY, 1, encode(parse("{sm}"), {"__qi_auth_state": 2})), "wants a login"),
        (b"", "no answer within 0.3 s"),
    ],
    ids=["a number", "web server", "4 GiB", "other version", "login", "silence"],
)
def test_who_does_not_answer_as_naoqi_does_is_no_robot(reply, said) -> None:
    def script(end: socket.socket) -> None:
        receive(end)
        end.sendall(reply)

    with Crooked(script) as url, pytest.raises(NaoqiError, match=said):
        Client(url, timeout=10.0 if reply else 0.3)


def test_a_robot_that_knows_no_first_question_is_told_the_capabilities() -> None:
    seen = []

    def old(end: socket.socket) -> None:
        end.sendall(message(ERROR, receive(end)[1], encode(parse("m"), "no such method")))
        seen.append(receive(end))

    with Crooked(old) as url:
        client = Client(url)
        deadline = time.monotonic() + 10
        while not seen and time.monotonic() < deadline:
            time.sleep(0.01)
        client.close()
    assert [(kind, *place) for kind, _, *place in seen] == [(CAPABILITY, 0, 0, 0)]


def test_answers_are_taken_in_any_order_and_in_pieces_and_calls_are_refused() -> None:
    refused = []

    def script(end: socket.socket) -> None:
        let_in(end)
        calls = [receive(end)[1] for _ in range(2)]
        end.sendall(message(CALL, 5, b"", 3, 1, 100))
        refused.append(receive(end))
        data = message(REPLY, 12345, b"") + message(REPLY, calls[1], encode(parse("m"), "b"), 1, 1, 1, flags=1)
        data += message(REPLY, calls[0], encode(parse("i"), 7), 1, 1, 1)
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for byte in data:
            end.send(bytes([byte]))

    with Crooked(script) as url:
        client = Client(url)
        first, second = (client.wires[0].call(1, 1, b"", "i", "x") for _ in range(2))
        assert (second.value(10), first.value(10)) == ("b", 7)
        client.close()
    assert refused[0][:2] == (ERROR, 5)


def test_calls_without_an_answer_are_bounded(monkeypatch) -> None:
    monkeypatch.setattr(naoqi_connection, "MOST_OPEN", 3)
    with Crooked(let_in) as url:
        client = Client(url)
        wire = client.wires[0]
        for _ in range(3):
            wire.call(1, 1, b"", "v", "x")
        with pytest.raises(NaoqiError, match="3 calls have no answer"):
            wire.call(1, 1, b"", "v", "x")
        client.close()


def test_an_aborted_connection_delivers_nothing_more() -> None:
    """Sending does not wait for a robot that reads nothing: the connection ends, and what waits in it is lost."""
    received, ended = [], []
    aborted, known = threading.Event(), threading.Event()

    def script(end: socket.socket) -> None:
        let_in(end)
        aborted.wait(10)
        try:
            while data := end.recv(65536):
                received.append(len(data))
            ended.append("closed")
        except ConnectionResetError:
            ended.append("reset")
        known.set()

    with Crooked(script) as url:
        client = Client(url)
        wire, sent = client.wires[0], 0
        wire.call(1, 1, bytes(1000), "v", "small", POST)
        with pytest.raises(NaoqiError, match="takes nothing more"):
            for _ in range(1000):
                wire.call(1, 1, bytes(65536), "v", "large", POST)
                sent += 65536
        assert wire.problem == "it takes nothing more" and sent > 0
        aborted.set()
        assert known.wait(10)
        client.close()
    assert ended == ["reset"] and sum(received) < sent


@pytest.mark.parametrize(
    ("signature", "data"),
    [
        ("i", b"\1\2"),
        ("s", b"\xff\xff\xff\xff"),
        ("[i]", b"\xff\xff\xff\x7f"),
        ("[[v]]", struct.pack("<II", 1, 1000) + bytes(2000)),
        ("{[i]i}", struct.pack("<III", 1, 0, 5)),
        ("m", struct.pack("<I", 4) + b"[m]?" + bytes(8)),
        ("m", b"".join(struct.pack("<I", 1) + b"m" for _ in range(100))),
        ("o", bytes(100)),
    ],
)
def test_bytes_that_are_no_value_are_refused(signature, data) -> None:
    with pytest.raises(NaoqiError):
        decode(parse(signature), data)


@pytest.mark.parametrize("signature", ["", "(", "[ii]", "{i}", "(i)<a", "?", "ii", "[" * 100, "i" * 100_000])
def test_what_is_no_signature_is_refused(signature) -> None:
    with pytest.raises(NaoqiError):
        parse(signature)


def test_values_survive_the_way() -> None:
    for signature, value in (
        ("(bcCwWiIlL)", (True, -1, 1, -2, 2, -3, 3, -4, 4)),
        ("(fd)<Speed,slow,fast>", (0.5, 0.1)),
        ("{s[(sm)<P,a,b>]}", {"key": [("a", b"raw"), ("b", None), ("c", {1: [2.5]})]}),
        ("(+i+i)", (None, 5)),
    ):
        assert decode(parse(signature), encode(parse(signature), value)) == value
