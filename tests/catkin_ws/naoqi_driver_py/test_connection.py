from __future__ import annotations

import contextlib
import logging
import os
import socket
import threading
import time
from pathlib import Path
from typing import Any

import pytest
import qi
from machines import Machine
from naoqi_driver import call_back
from naoqi_driver.connection import Address, CallRefused, Connection, Login, RobotUnreachable, _hint
from talker import Caller

from telepresence import start_patience
from telepresence.naoqi import Session
from telepresence.naoqi.python_object import served
from telepresence.naoqi.reactor import reactor
from telepresence.naoqi.server import Server

PROGRAMS = Path(__file__).parent / "programs"


class Motion:
    def __init__(self) -> None:
        self.commands: list[tuple] = []

    def move(self, x: float, y: float, theta: float) -> None:
        self.commands.append((x, y, theta))

    def refuse(self) -> None:
        raise ValueError("legs are folded")

    def refuse_as_modules_do(self) -> qi.Future:
        refusal = qi.Promise()
        refusal.setError("\tALProxy::ALProxy\n\tCan't find service: PilotsEars")
        return refusal.future()

    def stopMove(self) -> qi.Future:
        """Never finishes."""
        self.promise = qi.Promise()
        return self.promise.future()


@pytest.fixture
def motion(naoqi) -> Motion:
    service = Motion()
    naoqi.register("ALMotion", service)
    return service


@pytest.mark.parametrize(
    ("ip", "port", "url"),
    [
        ("10.0.0.7", 9559, "tcp://10.0.0.7:9559"),
        ("pepper.local", 9560, "tcp://pepper.local:9560"),
        ("10.0.0.7:1234", 9559, "tcp://10.0.0.7:1234"),
        ("tcps://10.0.0.7", 9503, "tcps://10.0.0.7:9503"),
        ("tcps://10.0.0.7:9503", 9559, "tcps://10.0.0.7:9503"),
    ],
)
def test_address_accepts_what_people_type(ip, port, url):
    assert str(Address.parse(ip, port)) == url


@pytest.mark.parametrize("ip", ["", "http://10.0.0.7", "tcp://"])
def test_address_refuses_nonsense(ip):
    with pytest.raises(ValueError, match="address"):
        Address.parse(ip)


def test_calls_reach_the_robot(naoqi, motion):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as link:
        assert link.wait_connected(10)
        link.call("ALMotion", "move", 0.2, 0.0, -0.5)
    assert motion.commands == [(0.2, 0.0, -0.5)]


def test_refusal_carries_the_robots_reason(naoqi, motion):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as link:
        assert link.wait_connected(10)
        with pytest.raises(CallRefused, match=r"ALMotion\.refuse: .*legs are folded"):
            link.call("ALMotion", "refuse")
        with pytest.raises(CallRefused, match=r"modules_do: ALProxy::ALProxy: Can't find service: PilotsEars$"):
            link.call("ALMotion", "refuse_as_modules_do")
        with pytest.raises(CallRefused, match="ALSonar"):
            link.call("ALSonar", "subscribe", "test")
        assert link.connected, "a refusal is no reason to give up the link"


def test_a_reply_that_does_not_come_is_given_up(naoqi, motion):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as link:
        assert link.wait_connected(10)
        with pytest.raises(RobotUnreachable, match=r"ALMotion\.stopMove: no reply .* within 0\.1 s"):
            link.call("ALMotion", "stopMove", timeout=0.1)
        link.call("ALMotion", "move", 0.0, 0.0, 0.0)
        assert link.connected, "the robot answers otherwise, so the link stays"


def test_who_does_not_wait_for_a_reply_hears_of_a_failure(naoqi, motion, make_connection, wait_until):
    failures: list[Exception] = []
    wire = make_connection(naoqi.port)
    with Connection(Address.parse("127.0.0.1", wire.port)) as link:
        assert link.wait_connected(10)
        link.call_async("ALMotion", "move", 0.0, 0.0, 0.0).on_failure(failures.append)
        link.call_async("ALMotion", "refuse").on_failure(failures.append)
        wait_until(lambda: failures, "the refusal is reported")
        link.call_async("ALMotion", "stopMove").on_failure(failures.append)
        wire.cut()
        wait_until(lambda: len(failures) == 2, "the loss is reported")
    assert [type(failure) for failure in failures] == [CallRefused, RobotUnreachable]


def test_call_without_a_link_fails_at_once(free_port):
    with Connection(Address.parse("127.0.0.1", free_port())) as link:
        with pytest.raises(RobotUnreachable, match="not reachable"):
            link.call("ALMotion", "move", 0.0, 0.0, 0.0)


def test_unreachable_robot_is_reported_once_with_address_and_cause(free_port, caplog, wait_until, monkeypatch):
    monkeypatch.setenv(start_patience.VARIABLE, "0.1")
    port = free_port()
    with caplog.at_level(logging.INFO), Connection(Address.parse("127.0.0.1", port)) as link:
        wait_until(lambda: caplog.records, "the trouble is reported")
        assert "refused" in link.problem
        time.sleep(1.0)  # more attempts
    said = [record.message for record in caplog.records]
    assert len(said) == 1
    assert f"tcp://127.0.0.1:{port}" in said[0]
    assert "Connection refused" in said[0]
    assert f"nao_ip:= its address?  ./stack doctor 127.0.0.1:{port}" in said[0], "what a person can look at"


def test_a_robot_that_is_there_and_refuses_us_is_not_looked_for_in_the_network():
    address = Address.parse("10.0.0.7")
    assert _hint(address, "no answer within 2 s").endswith("./stack doctor 10.0.0.7")
    assert _hint(address, "Connect error: -2: Name or service not known (tcp://pepper:9559)")
    assert _hint(address, "Connect error: the certificate of 10.0.0.7:9503 has changed") == ""
    assert _hint(address, "Authentication failed") == ""


@pytest.mark.parametrize("fault", ["cut", "freeze"])
def test_link_comes_back_after_a_fault_of_the_network(naoqi, motion, make_connection, wait_until, fault):
    wire = make_connection(naoqi.port)
    lost = threading.Event()
    with Connection(Address.parse("127.0.0.1", wire.port), on_lost=lambda cause: lost.set()) as link:
        assert link.wait_connected(10)
        getattr(wire, fault)()
        if fault == "freeze":
            with pytest.raises(RobotUnreachable):
                link.call("ALMotion", "move", 0.1, 0.0, 0.0, timeout=0.2)
        assert lost.wait(10)
        wire.thaw()
        wait_until(lambda: link.connections == 2, "connected again")
        link.call("ALMotion", "move", 0.3, 0.0, 0.0)
    assert motion.commands[-1] == (0.3, 0.0, 0.0)


class Speech:
    def __init__(self) -> None:
        self.said: list[str] = []

    def say(self, sentence: str) -> None:
        self.said.append(sentence)


def delivering(machine: Machine) -> bool:
    """Whether a closed connection still has something to deliver: FIN_WAIT1, 04 in include/net/tcp_states.h."""
    return "04" in [row.split()[3] for row in machine.run("cat", "/proc/net/tcp").splitlines()]


def test_what_was_said_into_a_cut_network_is_not_said_when_it_is_back(workspace_environment, wait_until):
    machine, speech = Machine(), Speech()
    reactor()  # outside, if it is not there yet: a thread and those that it starts stay on the machine of their birth
    try:
        with machine.entered():
            robot = Server("tcp://127.0.0.1:0")
            robot.register("ALTextToSpeech", served(speech))
            robot.start()
            link = Caller(workspace_environment, PROGRAMS / "commanded_link.py", robot.endpoints[0])
        try:
            wait_until(link.connected, "connected")
            link.say("first")
            wait_until(lambda: speech.said == ["first"], "it is said")

            def said_into_the_cut_network() -> bool:
                """A machine that is held up may lose the link before the sentence is sent."""
                machine.run("ip", "link", "set", "lo", "up")
                wait_until(link.connected, "connected")
                machine.run("ip", "link", "set", "lo", "down")
                return link.say("into the cut network")

            wait_until(said_into_the_cut_network, "it is sent while the link counts as up")
            wait_until(lambda: not link.connected(), "the link counts as lost")
            machine.run("ip", "link", "set", "lo", "up")
            wait_until(lambda: not delivering(machine), "the kernel has nothing left to deliver")
            wait_until(lambda: link.say("last"), "connected again")
            wait_until(lambda: "last" in speech.said, "it is said")
        finally:
            link.close()
            robot.close()
    finally:
        machine.close()
    assert speech.said == ["first", "last"]


def test_link_comes_back_to_a_restarted_robot(naoqi, motion, wait_until):
    with Connection(Address.parse("127.0.0.1", naoqi.port)) as link:
        wait_until(lambda: link.connected, "connected")
        naoqi.close()
        wait_until(lambda: not link.connected, "loss noticed")
        again = qi.Session()
        again.listenStandalone(f"tcp://127.0.0.1:{naoqi.port}")
        again.registerService("ALMotion", Motion())
        wait_until(lambda: link.connections == 2, "connected again")
        link.call("ALMotion", "move", 0.1, 0.0, 0.0)
        again.close()


def test_close_does_not_wait_for_a_silent_robot(naoqi, make_connection):
    wire = make_connection(naoqi.port)
    wire.freeze()
    link = Connection(Address.parse("127.0.0.1", wire.port)).start()
    time.sleep(0.2)  # so that it waits for an answer
    began = time.monotonic()
    link.close()
    assert time.monotonic() - began < 1.0


def test_user_and_password_are_what_the_library_asks_an_authenticator_for():
    login = Login("nao", "secret").newAuthenticator()
    assert login.initialAuthData() == {"user": "nao", "token": "secret"} == login._processAuth({"newToken": "other"})


class Ears:
    def __init__(self) -> None:
        self.heard: list[tuple] = []

    def processRemote(self, channels: int, count: int, stamp: Any, sound: Any) -> None:
        self.heard.append((channels, count, stamp, bytes(sound)))


def listening() -> set[str]:
    """Local addresses on which this process listens."""
    held = set()
    for path in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            held.add(os.readlink(path))
    rows = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    return {row[1] for row in rows if row[3] == "0A" and f"socket:[{row[9]}]" in held}


@pytest.mark.parametrize("listen", [None, call_back.AUTOMATIC], ids=["not asked for", "automatic"])
def test_the_robot_calls_our_service_over_our_connection_and_nothing_listens(naoqi, wait_until, listen):
    ears, before = Ears(), listening()
    with Connection(Address.parse("127.0.0.1", naoqi.port), listen=listen) as link:
        assert link.wait_connected(10)
        link.register_service("PilotsEars", ears)
        remote = naoqi.session.service("PilotsEars")
        remote.processRemote(1, 2, [3, 4], b"\xff\0ab")
        assert listening() == before
    wait_until(lambda: ears.heard == [(1, 2, [3, 4], b"\xff\0ab")], "heard")
    wait_until(
        lambda: "PilotsEars" not in [each["name"] for each in naoqi.session.services()], "it goes with the connection"
    )


def test_another_program_of_the_robot_calls_our_service_where_we_listen(naoqi, wait_until):
    """As ALAudioDevice beside the service directory; with the vendor's library see test_robot_that_dials.py."""
    ears, before = Ears(), listening()
    with Connection(Address.parse("127.0.0.1", naoqi.port), listen="tcp://0.0.0.0:0") as link:
        assert link.wait_connected(10)
        assert not link.listens_at, "there is no service yet"
        link.register_service("PilotsEars", ears)
        port = int(link.listens_at.rpartition(":")[2])
        assert listening() - before == {f"0100007F:{port:04X}"}, "on the address towards the robot"
        program = Session()
        program.connect(f"tcp://127.0.0.1:{naoqi.port}")
        program.service("PilotsEars").processRemote(1, 2, [3, 4], b"\xff\0ab")
        program.close()
    wait_until(lambda: ears.heard == [(1, 2, [3, 4], b"\xff\0ab")], "heard")
    wait_until(lambda: listening() == before, "nothing listens any more")


def test_a_port_that_is_taken_leaves_our_connection(naoqi, caplog):
    with socket.create_server(("127.0.0.1", 0)) as other:
        url = f"tcp://127.0.0.1:{other.getsockname()[1]}"
        with Connection(Address.parse("127.0.0.1", naoqi.port), listen=url) as link:
            assert link.wait_connected(10)
            link.register_service("PilotsEars", Ears())
            naoqi.session.service("PilotsEars").processRemote(1, 2, [3, 4], b"\xff\0ab")
            assert not link.listens_at and "Cannot listen" in caplog.text


def test_what_is_registered_too_late_is_unregistered(naoqi, make_connection, wait_until):
    come, gone = [], []
    naoqi.session.serviceRegistered.connect(lambda number, name: come.append((number, name)))
    naoqi.session.serviceUnregistered.connect(lambda number, name: gone.append((number, name)))
    wire = make_connection(naoqi.port)
    with Connection(Address.parse("127.0.0.1", wire.port)) as link:
        assert link.wait_connected(10)
        wire.freeze()
        with pytest.raises(RobotUnreachable, match="registering PilotsEars"):
            link.register_service("PilotsEars", Ears())
        wire.thaw()
        wait_until(lambda: "PilotsEars" in [name for _, name in come], "it is registered after all")
        wait_until(lambda: gone == come, "and no more, because nobody knows its number")


def test_callbacks_tell_of_gain_and_loss(naoqi, wait_until):
    told = []
    link = Connection(Address.parse("127.0.0.1", naoqi.port), lambda: told.append("up"), told.append)
    with link:
        wait_until(lambda: told == ["up"], "gain told")
        naoqi.close()
        wait_until(lambda: told == ["up", "it closed the connection"], "loss told")
