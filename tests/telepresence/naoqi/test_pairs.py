"""NAOqi's messaging by the vendor's `qi` and by ours, each as client and as server: four pairs, one set of tests.

The server runs in a process of its own (tests/lab/naoqi_services.py). Where the vendor's library cannot do what a row
asks for, the row says what it does instead, and the test holds it to that.
"""

from __future__ import annotations

import importlib
import itertools
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest
from naoqi_services import LIBRARIES, OURS, SIGNATURES, VENDOR, ServerProcess, signed
from waiting import wait_until

PATIENCE = 20.0
"""Seconds after which something counts as never coming."""
MS = int(PATIENCE * 1000)
LABELS = {VENDOR: "libqi", OURS: "ours"}


class Pair(NamedTuple):
    """A client that is connected to a server of perhaps the other library."""

    client: str
    server: str
    qi: Any
    session: Any
    process: ServerProcess

    @property
    def names(self) -> tuple[str, str]:
        return self.client, self.server

    def service(self, name: str) -> Any:
        return self.session.service(name)


def library(name: str) -> Any:
    module = importlib.import_module(name)
    if name == VENDOR:
        module.logging.setLevel(module.logging.FATAL)
    return module


@pytest.fixture(scope="module")
def servers() -> Iterator[Callable[[str], ServerProcess]]:
    """One of each library, started when it is asked for."""
    running: dict[str, ServerProcess] = {}

    def server(name: str) -> ServerProcess:
        if name not in running:
            running[name] = ServerProcess(name)
        return running[name]

    try:
        yield server
    finally:
        for server in running.values():
            server.close()


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(names, id="-".join(LABELS[name] for name in names), marks=[pytest.mark.vendor] * (VENDOR in names))
        for names in itertools.product(LIBRARIES, LIBRARIES)
    ],
)
def pair(request: pytest.FixtureRequest, servers: Callable[[str], ServerProcess]) -> Iterator[Pair]:
    client, server = request.param
    qi = library(client)
    session = qi.Session()
    session.connect(servers(server).url)
    yield Pair(client, server, qi, session, servers(server))
    session.close()


@pytest.fixture
def talk(pair: Pair) -> Any:
    return pair.service("Conversation")


def plain(value: Any) -> Any:
    """Without the difference between bytes and bytearray."""
    if isinstance(value, (bytes, bytearray, memoryview)):
        return bytes(value)
    if isinstance(value, (list, tuple)):
        return type(value)(map(plain, value))
    return value


# --- values ----------------------------------------------------------------------------------------------------------

ERROR = object()
"""The call is refused with a RuntimeError."""
LIBQI_CLIENT, LIBQI_SERVER, LIBQI_ANYWHERE = "libqi as client", "libqi as server", "libqi at either end"


class Value(NamedTuple):
    """What is sent as a signature, what comes back, and what libqi makes of it at the end named."""

    signature: str
    sent: Any
    back: Any = None
    libqi: tuple[str, Any] | None = None

    def expected(self, pair: Pair) -> Any:
        if self.libqi:
            where, value = self.libqi
            at = {
                LIBQI_CLIENT: pair.client == VENDOR,
                LIBQI_SERVER: pair.server == VENDOR,
                LIBQI_ANYWHERE: VENDOR in pair.names,
            }[where]
            if at:
                return value
        return self.sent if self.back is None else self.back


VALUES = [
    *(Value("b", value) for value in (True, False)),
    Value("b", 1, True),
    Value("b", 7, ERROR),
    Value("c", -128),
    Value("c", 200, ERROR),
    Value("C", 255),
    Value("C", -1, ERROR),
    Value("w", -(2**15)),
    Value("W", 2**16 - 1),
    Value("i", 2**31 - 1),
    Value("i", -(2**31)),
    Value("i", 2**31, ERROR),
    Value("i", 2.9, 2),
    Value("i", "x", ERROR),
    Value("i", None, ERROR),
    Value("i", math.inf, ERROR),
    Value("I", 2**32 - 1),
    Value("I", -1, ERROR),
    Value("l", -(2**63)),
    Value("L", 2**63 - 1),
    Value("L", 2**64 - 1, libqi=(LIBQI_ANYWHERE, ERROR)),  # its Python numbers end at 2^63 - 1
    Value("f", 1.5),
    Value("f", 3, 3.0),
    Value("f", math.inf, libqi=(LIBQI_SERVER, ERROR)),  # it does not narrow an infinity
    Value("f", "x", ERROR),
    Value("d", 1e300),
    Value("d", -0.0),
    Value("s", "ä\N{ROBOT FACE}\0x"),
    Value("s", ""),
    Value("s", b"abc", "abc"),
    Value("s", 5, ERROR),
    Value("r", b"\x00\xff"),
    Value("r", "text", b"text"),
    Value("m", True),
    Value("m", -(2**63)),
    Value("m", 1.5),
    Value("m", "x"),
    Value("m", b"xy", libqi=(LIBQI_ANYWHERE, "xy")),  # it sends bytes inside dynamics as a string
    Value("m", [1, "a", [2.5, None], {"k": [True]}]),
    Value("m", (1, "a")),
    Value("m", {1: [2], 3: "b"}),
    Value("m", {"a": 1, 2: "mixed"}),
    Value("m", []),
    Value("m", [["\n"] * 3] * 200),
    Value("[i]", [1, -2]),
    Value("[i]", [1, 2.9], [1, 2]),
    Value("[i]", [1, "x"], ERROR),
    Value("[f]", [0.5, 2], [0.5, 2.0]),
    Value("[s]", ["a", ""]),
    Value("[m]", [1, "a", None, [2.5]]),
    Value("[[i]]", [[1], [], [2, 3]]),
    Value("{ss}", {"a": "b"}),
    Value("{sm}", {"a": 1, "b": [1.5]}),
    Value("{is}", {1: "a", -1: ""}),
    Value("(is)", (1, "a")),
    Value("(is)", [1, "a"], (1, "a")),
    Value("(is)", (1,), ERROR),
    Value("(fs[i])", (1.5, "a", [1])),
    Value("+i", 3),
    Value("+s", "a"),
    Value("[(is)]", [(1, "a"), (2, "b")]),
    Value("{s[f]}", {"a": [0.5], "b": []}),
]


@pytest.mark.parametrize("row", VALUES, ids=lambda row: f"{row.signature} {row.sent!r:.30}")
def test_a_value_comes_back(pair: Pair, row: Value) -> None:
    method = f"echo{SIGNATURES.index(row.signature)}"
    expected = row.expected(pair)
    if expected is ERROR:
        with pytest.raises(RuntimeError):
            pair.service("Values").call(method, row.sent)
        return
    back = plain(pair.service("Values").call(method, row.sent))
    assert back == expected and type(back) is type(expected)


@pytest.mark.parametrize("signature", ["m", "+i", "+s"])
def test_none_comes_back(pair: Pair, signature: str) -> None:
    assert pair.service("Values").call(f"echo{SIGNATURES.index(signature)}", None) is None


def test_no_number_comes_back_as_no_number(pair: Pair) -> None:
    for signature in "fd":
        assert math.isnan(pair.service("Values").call(f"echo{SIGNATURES.index(signature)}", math.nan))


def test_a_record_is_read_by_its_fields(pair: Pair) -> None:
    values, number = pair.service("Values"), SIGNATURES.index("(is)<Named,number,text>")
    for sent in ((1, "a"), {"number": 1, "text": "a"}):
        assert dict(values.call(f"echo{number}", sent)) == {"number": 1, "text": "a"}


def test_bytes_that_are_no_text_survive_as_raw_data(pair: Pair) -> None:
    data = bytes(range(256)) * 2500
    assert plain(pair.service("Values").call(f"echo{SIGNATURES.index('r')}", data)) == data
    picture = pair.service("Conversation").picture(614_400)
    assert len(picture) == 12 and picture[:2] == [640, 480]
    # libqi's Python server sends raw data inside dynamics as a string.
    assert len(picture[6]) == 614_400


# --- calls -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "taken"),
    [((1,), "i"), ((1.5,), "i"), (("x",), "s"), (([1, 2],), "[f]"), (("a", True), "mm")],
    ids=repr,
)
def test_overloads_are_chosen_as_libqi_chooses(talk: Any, arguments: tuple, taken: str) -> None:
    assert talk.over(*arguments) == taken


def test_an_overload_is_named_in_full(talk: Any) -> None:
    assert talk.call("over::(sb)", "a", True) == "sb"


@pytest.mark.parametrize("arguments", [(), (1, 2, 3), (None,)], ids=repr)
def test_no_overload_fits(talk: Any, arguments: tuple) -> None:
    with pytest.raises(RuntimeError, match="Arguments types did not match for over"):
        talk.over(*arguments)


def test_the_error_of_a_method_arrives_with_its_text(talk: Any) -> None:
    with pytest.raises(RuntimeError, match="too hot: 84 °C"):
        talk.fail("too hot: 84 °C")


def test_a_result_of_another_type_is_an_error(talk: Any) -> None:
    with pytest.raises(RuntimeError):
        talk.wrong()


def test_what_is_not_there(pair: Pair, talk: Any) -> None:
    with pytest.raises(RuntimeError, match="Cannot find service 'Nope' in index"):
        pair.service("Nope")
    with pytest.raises(AttributeError):
        _ = talk.nope
    with pytest.raises(RuntimeError, match="nope"):
        talk.call("nope")


def test_futures_complete_in_the_order_of_the_answers(talk: Any) -> None:
    slow, quick = talk.later(3000, _async=True), talk.later(20, _async=True)
    assert slow.isRunning()
    assert quick.value(MS) == 20
    done: queue.Queue = queue.Queue()
    slow.addCallback(lambda future: done.put(future.value()))
    assert done.get(timeout=PATIENCE) == 3000
    assert slow.isFinished() and not slow.hasError()


def test_chained_futures(talk: Any) -> None:
    assert talk.later(1, _async=True).andThen(lambda value: value + 1).value(MS) == 2
    failed = talk.fail("no", _async=True).then(lambda future: future.hasError())
    assert failed.value(MS) is True
    assert "no" in talk.fail("no", _async=True).error(MS)


def test_waiting_has_an_end(talk: Any) -> None:
    future = talk.never(_async=True)
    begin = time.monotonic()
    with pytest.raises(RuntimeError):
        future.value(50)
    assert time.monotonic() - begin < PATIENCE and future.isRunning()
    future.cancel()
    future.wait(MS)


def test_a_call_is_cancelled_at_the_server(talk: Any) -> None:
    before = talk.cancels()
    future = talk.never(_async=True)
    talk.cancels()  # comes after it
    future.cancel()
    wait_until(future.isFinished, "the future ends")
    assert future.isCanceled() and talk.cancels() == before + 1


def test_two_hundred_calls_at_once(talk: Any) -> None:
    futures = [talk.later(10, _async=True) for _ in range(200)]
    assert [future.value(MS) for future in futures] == [10] * 200


# --- signals and properties ------------------------------------------------------------------------------------------


def test_events_come_in_order(pair: Pair, talk: Any) -> None:
    heard: queue.Queue = queue.Queue()
    link = talk.counted.connect(lambda number, text: heard.put((number, text)))
    talk.count(0, 500)
    events = [heard.get(timeout=PATIENCE) for _ in range(500)]
    if VENDOR in pair.names:  # it emits, and calls back, on several threads, which overtake each other
        events.sort()
    assert events == [(n, f"number {n}") for n in range(500)]
    talk.counted.disconnect(link)
    talk.count(0, 3)
    talk.count(0, 0)
    assert heard.empty()


def test_two_listeners_of_one_signal(talk: Any) -> None:
    first: queue.Queue = queue.Queue()
    second: queue.Queue = queue.Queue()
    link = talk.counted.connect(lambda *_: first.put(1))
    other = talk.counted.connect(lambda *_: second.put(1))
    talk.count(0, 1)
    assert first.get(timeout=PATIENCE) and second.get(timeout=PATIENCE)
    talk.counted.disconnect(link)
    talk.count(0, 1)
    assert second.get(timeout=PATIENCE) and first.empty()
    talk.counted.disconnect(other)


@pytest.mark.parametrize("value", [1, "x", [1, [2.5]], None], ids=repr)
def test_a_signal_of_any_type(talk: Any, value: Any) -> None:
    heard: queue.Queue = queue.Queue()
    link = talk.anything.connect(heard.put)
    talk.emit(value)
    assert heard.get(timeout=PATIENCE) == value
    talk.anything.disconnect(link)


def test_a_client_emits(talk: Any) -> None:
    heard: queue.Queue = queue.Queue()
    link = talk.counted.connect(lambda *values: heard.put(values))
    talk.count(0, 0)  # the registration is there
    talk.counted(7, "from the client")
    assert heard.get(timeout=PATIENCE) == (7, "from the client")
    talk.counted.disconnect(link)


def test_a_property_is_set_read_and_told(talk: Any) -> None:
    heard: queue.Queue = queue.Queue()
    link = talk.level.connect(heard.put)
    talk.level.setValue(2.5)
    assert heard.get(timeout=PATIENCE) == 2.5 and talk.level.value() == 2.5
    talk.level.setValue(3)
    assert heard.get(timeout=PATIENCE) == 3.0 and talk.level.value() == 3.0
    talk.level.disconnect(link)
    with pytest.raises(RuntimeError):
        talk.level.setValue("high")
    assert talk.level.value() == 3.0
    talk.record.setValue({"a": [1, None]})
    assert talk.record.value() == {"a": [1, None]}


# --- objects ---------------------------------------------------------------------------------------------------------


def test_an_object_that_a_method_returns(talk: Any) -> None:
    subscriber = talk.subscriber("FaceDetected")
    heard: queue.Queue = queue.Queue()
    subscriber.signal.connect(heard.put)
    for value in range(20):
        subscriber.raiseEvent(value)
        assert heard.get(timeout=PATIENCE) == value
    assert subscriber.name() == "FaceDetected" and subscriber.child().child().name() == "FaceDetected''"
    subscriber.value.setValue(5)
    assert subscriber.value.value() == 5


def test_an_object_inside_a_dynamic(talk: Any) -> None:
    name, subscriber = talk.subscriber_inside("inside")
    assert name == subscriber.name() == "inside"


def test_an_object_that_a_client_hands_over_is_called_back(pair: Pair, talk: Any) -> None:
    class Named:
        @signed("()", "s")
        def name(self) -> str:
            return "Klára"

    assert talk.ask(Named()) == "the name is Klára"


def test_a_servers_object_is_handed_back(talk: Any) -> None:
    assert talk.ask(talk.subscriber("itself")) == "the name is itself"


# --- services of a client --------------------------------------------------------------------------------------------


def heard_service(qi: Any) -> tuple[Any, queue.Queue]:
    heard: queue.Queue = queue.Queue()

    class Listener:
        @signed("(iimr)", "v")
        def processRemote(self, channels: int, samples: int, stamp: Any, data: bytes) -> None:
            heard.put((channels, samples, stamp, bytes(data)))

        @signed("(i)", "i")
        def twice(self, value: int) -> int:
            return 2 * value

        @signed("()", "v")
        def refuse(self) -> None:
            raise RuntimeError("not now")

    return Listener(), heard


def test_the_robot_calls_a_service_that_a_client_registered(pair: Pair, talk: Any) -> None:
    listener, heard = heard_service(pair.qi)
    number = pair.session.registerService("Listener", listener)
    try:
        assert talk.call_back("Listener", "twice", [21]) == 42
        talk.call_back("Listener", "processRemote", [4, 2, [1, 2], "\0\x01" * 4])
        assert heard.get(timeout=PATIENCE) == (4, 2, [1, 2], b"\0\x01" * 4)
        with pytest.raises(RuntimeError, match="not now"):
            talk.call_back("Listener", "refuse", [])
        with pytest.raises(RuntimeError, match="already registered"):
            pair.session.registerService("Listener", listener)
    finally:
        pair.session.unregisterService(number)
    with pytest.raises(RuntimeError):
        talk.call_back("Listener", "twice", [21])


def test_the_directory_tells_who_comes_and_goes(pair: Pair) -> None:
    watcher = pair.qi.Session()
    watcher.connect(pair.process.url)
    changes: queue.Queue = queue.Queue()
    watcher.serviceRegistered.connect(lambda number, name: changes.put(("came", number, name)))
    watcher.serviceUnregistered.connect(lambda number, name: changes.put(("went", number, name)))
    other = pair.qi.Session()
    other.connect(pair.process.url)
    first = other.registerService("Comer", heard_service(pair.qi)[0])
    assert changes.get(timeout=PATIENCE) == ("came", first, "Comer")
    other.unregisterService(first)
    assert changes.get(timeout=PATIENCE) == ("went", first, "Comer")
    second = other.registerService("Comer", heard_service(pair.qi)[0])
    assert second > first and changes.get(timeout=PATIENCE) == ("came", second, "Comer")
    assert "Comer" in {info["name"] for info in watcher.services()}
    other.close()  # what it registered goes with it
    assert changes.get(timeout=PATIENCE) == ("went", second, "Comer")
    watcher.close()


# --- a server that goes and comes ------------------------------------------------------------------------------------


def test_a_server_goes_and_comes(pair: Pair) -> None:
    """Open calls fail soon, the client is told, and the same session connects again; old proxies stay dead."""
    with ServerProcess(pair.server) as server:
        session = pair.qi.Session()
        lost = threading.Event()
        session.disconnected.connect(lambda *_: lost.set())
        session.connect(server.url)
        old = session.service("Conversation")
        waiting = old.never(_async=True)
        server.kill()
        assert waiting.hasError(MS) and lost.wait(PATIENCE)
        wait_until(lambda: not session.isConnected(), "it knows that it is not connected")
        with pytest.raises(RuntimeError):
            old.cancels()
        with pytest.raises(RuntimeError):
            session.connect(server.url)
    with ServerProcess(pair.server, "--port", str(server.port)):
        session.connect(server.url)
        assert session.service("Conversation").later(1) == 1
        with pytest.raises(RuntimeError):
            old.cancels()
        session.close()
