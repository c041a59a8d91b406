"""Both clients against robots of every release: our server playing all of them and libqi 4, and libqi playing 2.5.

What the vendor's client of today cannot do with an older robot stands in the test that shows it.
"""

from __future__ import annotations

import importlib
import queue
import struct
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from naoqi_bytes import CALL, REPLY, Message, dynamic, text
from naoqi_relay import Between
from naoqi_services import OURS, PASSWORD, PLAYS_2_5, USER, VENDOR, ServerProcess, signed
from tls_front import make_certificate

PATIENCE = 20.0
MS = int(PATIENCE * 1000)
RELEASES = ("2.1", "2.5", "2.8", "2.9", "libqi 4")
CLIENTS = [pytest.param(VENDOR, id="libqi", marks=pytest.mark.vendor), pytest.param(OURS, id="ours")]


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    certificate = make_certificate(tmp_path_factory.mktemp("certificate"), "pepper")
    with ServerProcess(OURS, "--release", *RELEASES, "--certificate", str(certificate)) as process:
        yield process


@pytest.fixture(params=CLIENTS)
def qi(request: pytest.FixtureRequest) -> Any:
    module = importlib.import_module(request.param)
    module.logging.setLevel(module.logging.FATAL if request.param == VENDOR else 0)
    return module


class Login:
    """A factory, and the authenticator that it makes."""

    def __init__(self, user: str, token: str) -> None:
        self._data = {"user": user, "token": token}
        self.asked: list[dict] = []

    def newAuthenticator(self) -> Login:
        return self

    def initialAuthData(self) -> dict:
        return self._data

    def _processAuth(self, data: dict) -> dict:
        self.asked.append(dict(data))
        return {**self._data, "token": data.get("newToken", self._data["token"])}


def session_with(qi: Any, url: str, login: Login | None = None) -> Any:
    session = qi.Session()
    if login:
        session.setClientAuthenticatorFactory(login)
    session.connect(url, _async=True).value(MS)
    return session


def converse(qi: Any, session: Any) -> None:
    """Everything that a driver does with a robot."""
    talk = session.service("Conversation")
    assert session.service("Recorded").add(1, 2) == 3
    assert session.service("Values").call("echo13", [1, "a", {"k": [2.5]}]) == [1, "a", {"k": [2.5]}]
    heard: queue.Queue = queue.Queue()
    link = talk.counted.connect(lambda number, _text: heard.put(number))
    talk.count(7, 8)
    assert heard.get(timeout=PATIENCE) == 7
    talk.counted.disconnect(link)
    talk.level.setValue(2.5)
    assert talk.level.value() == 2.5
    with pytest.raises(RuntimeError, match="too hot"):
        talk.fail("too hot")
    waiting = talk.never(_async=True)
    waiting.cancel()
    for name in ("FaceDetected", "TouchChanged"):  # a second one of the same type is sent by its number in the cache
        subscriber = talk.subscriber(name)
        subscriber.signal.connect(heard.put)
        subscriber.raiseEvent([name, 1])
        assert heard.get(timeout=PATIENCE) == [name, 1] and subscriber.name() == name
        assert talk.ask(subscriber) == f"the name is {name}"
    assert talk.subscriber_inside("x")[1].name() == "x"

    class Listener:
        @signed("(iimr)", "v")
        def processRemote(self, channels: int, samples: int, stamp: Any, data: bytes) -> None:
            heard.put((channels, samples, bytes(data)))

    number = session.registerService("Listener", Listener())
    talk.call_back("Listener", "processRemote", [4, 2, [1, 2], "data"])
    assert heard.get(timeout=PATIENCE) == (4, 2, b"data")
    session.unregisterService(number)
    assert {"Recorded", "Conversation"} <= {info["name"] for info in session.services()}


@pytest.mark.parametrize("release", RELEASES)
def test_a_client_and_a_robot_of_this_release(robots: ServerProcess, qi: Any, release: str) -> None:
    login = Login(USER, PASSWORD) if release == "2.9" else None
    assert robots.urls[release].startswith("tcps:" if login else "tcp:")
    session = session_with(qi, robots.urls[release], login)
    converse(qi, session)
    session.close()


@pytest.mark.parametrize(
    "login",
    [Login(USER, "guessed"), Login("nobody", PASSWORD), Login(USER, ""), None],
    ids=["wrong password", "wrong user", "empty password", "no login"],
)
def test_a_login_that_is_refused(robots: ServerProcess, qi: Any, login: Login | None) -> None:
    with pytest.raises(RuntimeError):
        session_with(qi, robots.urls["2.9"], login)


def test_a_robot_that_gives_a_new_token(robots: ServerProcess, qi: Any) -> None:
    """State 2: the client is asked again, and answers with user and token, without its capabilities."""
    said: list[Message] = []

    def ask(message: Message) -> bytes:
        if (message.service, message.action, message.kind) == (0, 8, CALL):
            said.append(message)
            # The robot behind it hears the capabilities each time; it wants no login itself.
            return said[0]._replace(identity=message.identity).pack()
        return message.pack()

    def change(message: Message, _number: int) -> bytes:
        if (message.service, message.action, message.kind) != (0, 8, REPLY) or len(said) > 1:
            return message.pack()
        state = text("__qi_auth_state") + dynamic("I", struct.pack("<I", 2))
        token = text("auth_newToken") + dynamic("s", text("abc123"))
        (count,) = struct.unpack_from("<I", message.payload)
        rest = message.payload[4:].replace(text("__qi_auth_state") + dynamic("I", struct.pack("<I", 3)), b"")
        return message._replace(payload=struct.pack("<I", count + 1) + rest + state + token).pack()

    login = Login(USER, "old")
    with Between(robots.port, change, ask) as between:
        session = session_with(qi, between.url, login)
        assert session.service("Recorded").add(1, 2) == 3
        assert [data["newToken"] for data in login.asked] == ["abc123"]
        assert b"abc123" in said[1].payload and b"old" in said[0].payload
        session.close()


# --- libqi playing 2.5 -----------------------------------------------------------------------------------------------

STAYS = "+MetaObjectCache:-ObjectPtrUID"
"""Like 2.5, but the directory tells relative endpoints, so that every client stays on the connection that it has."""


@pytest.fixture(scope="module")
def older() -> Iterator[Callable[[str], ServerProcess]]:
    """libqi with other capabilities."""
    running: dict[str, ServerProcess] = {}

    def server(capabilities: str) -> ServerProcess:
        if capabilities not in running:
            running[capabilities] = ServerProcess(VENDOR, capabilities=capabilities)
        return running[capabilities]

    yield server
    for process in running.values():
        process.close()


@pytest.mark.vendor
@pytest.mark.parametrize("capabilities", [PLAYS_2_5, STAYS], ids=["2.5", "2.5 with relative endpoints"])
def test_libqi_that_plays_2_5(older: Callable[[str], ServerProcess], qi: Any, capabilities: str) -> None:
    session = session_with(qi, older(capabilities).url)
    converse(qi, session)
    session.close()


def announced(value: bool) -> Callable[[Message], bytes]:
    """What a gateway amounts to: the robot behind it is told something else about MetaObjectCache."""
    key = text("MetaObjectCache") + dynamic("b", b"")

    def ask(message: Message) -> bytes:
        if (message.service, message.action, message.kind) != (0, 8, CALL):
            return message.pack()
        place = message.payload.find(key) + len(key)
        assert place >= len(key)
        return message._replace(payload=message.payload[:place] + bytes([value]) + message.payload[place + 1 :]).pack()

    return ask


@pytest.mark.vendor
@pytest.mark.parametrize("capabilities", [PLAYS_2_5, STAYS], ids=["2.5", "2.5 with relative endpoints"])
@pytest.mark.parametrize("value", [True, False], ids=["cache announced", "cache hidden"])
def test_libqi_that_plays_2_5_behind_a_gateway(
    older: Callable[[str], ServerProcess], capabilities: str, value: bool
) -> None:
    """Our client reads objects in whichever form they come, and never says "Invalid signature"."""
    qi = importlib.import_module(OURS)
    with Between(older(capabilities).port, ask=announced(value)) as gateway:
        session = session_with(qi, gateway.url)
        converse(qi, session)
        session.close()


@pytest.mark.vendor
def test_the_vendors_client_fails_behind_that_gateway(older: Callable[[str], ServerProcess]) -> None:
    """Which is why users of 2.5 see "Invalid signature"; and so the test above would see it."""
    qi = importlib.import_module(VENDOR)
    with Between(older(STAYS).port, ask=announced(True)) as gateway:
        session = session_with(qi, gateway.url)
        with pytest.raises(RuntimeError, match="Invalid signature"):
            session.service("Conversation").subscriber("FaceDetected")
        session.close()
