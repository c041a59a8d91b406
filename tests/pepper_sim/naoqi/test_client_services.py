"""Services of clients as the robot sees them."""

from __future__ import annotations

import struct
import threading

import pytest
from naoqi_bytes import CALL, Message, RawPeer, text
from naoqi_clients import with_both_clients

from pepper_sim.naoqi import client_services
from pepper_sim.naoqi.client_services import ClientServices
from pepper_sim.naoqi.tasks import Alarm
from telepresence.naoqi.served_object import ServedObject
from telepresence.naoqi.server import Server

pytestmark = with_both_clients


class _Ears:
    """A client's service. `hang` waits until the test ends."""

    def __init__(self):
        self.received = []
        self.waiting = threading.Event()

    def take(self, *values):
        self.received.append(values)
        return len(self.received)

    def fail(self):
        raise ValueError("no")

    def hang(self):
        self.waiting.wait(30)


@pytest.fixture
def alarm():
    alarm = Alarm()
    yield alarm
    alarm.close()


@pytest.fixture
def clients(alarm):
    server = Server("tcp://127.0.0.1:0")
    server.register("ALOwn", ServedObject())
    server.start()
    clients = ClientServices(server, alarm)
    clients.remember_own()
    yield clients
    server.close()


@pytest.fixture
def ears(qi, clients):
    ears = _Ears()
    session = qi.Session()
    session.connect(clients.url)
    session.registerService("Ears", ears)
    ears.session = session
    yield ears
    ears.waiting.set()
    session.close()


def test_clients_services_beside_the_robots_own(clients, ears):
    assert clients.is_own("ALOwn") and not clients.is_own("Ears")
    assert clients.exists("ALOwn") and clients.exists("Ears") and not clients.exists("Else")
    assert {"ALOwn", "Ears"} <= set(clients.names())


def test_calls_arrive_in_order_and_answers_come_back(clients, ears):
    assert clients.call("Ears", "take", 0).result(30) == 1
    calls = [clients.call("Ears", "take", number) for number in range(1, 30)]
    assert [call.result(30) for call in calls] == list(range(2, 31))
    assert ears.received == [(number,) for number in range(30)]


def test_a_post_waits_for_nobody(clients, ears, wait_until):
    clients.post("Ears", "hang")
    clients.post("Ears", "take", b"\0\xff")
    ears.waiting.set()
    wait_until(lambda: ears.received, "it arrived")
    assert bytes(ears.received[0][0]) == b"\0\xff"


def test_what_cannot_be_called_is_an_error(clients, ears, wait_until):
    for name, method, refusal in (("Else", "take", "Cannot find service"), ("Ears", "smell", "has no method 'smell'")):
        with pytest.raises(RuntimeError, match=refusal):
            clients.call(name, method).result(30)
        with pytest.raises(RuntimeError, match=refusal):
            clients.post(name, method)
    with pytest.raises(RuntimeError, match="no"):
        clients.call("Ears", "fail").result(30)
    ears.session.close()
    wait_until(lambda: not clients.exists("Ears"), "it is gone")
    with pytest.raises(RuntimeError):
        clients.call("Ears", "take").result(30)
    with pytest.raises(RuntimeError):
        clients.post("Ears", "take")


def test_a_client_that_does_not_answer_has_failed(clients, ears, monkeypatch):
    clients.call("Ears", "take", 1).result(30)
    monkeypatch.setattr(client_services, "CALL_TIMEOUT", 0.2)
    with pytest.raises(TimeoutError, match="'Ears' has not answered"):
        clients.call("Ears", "hang").result(30)


class _Odd:
    """A service some of whose members bear names that a proxy has, too; `told` is a signal."""

    def __init__(self, signal):
        self.told = signal
        self.received = []

    def post(self, *values):
        self.received.append(values)
        return len(self.received)


@pytest.fixture
def odd(qi, clients):
    odd = _Odd(qi.Signal("(m)"))
    session = qi.Session()
    session.connect(clients.url)
    session.registerService("Odd", odd)
    yield odd
    session.close()


def test_a_method_may_have_the_name_of_a_proxys_own(clients, odd, wait_until):
    for number in range(3):
        clients.post("Odd", "post", number)
    wait_until(lambda: odd.received == [(0,), (1,), (2,)], "all arrived")
    assert clients.call("Odd", "post", 3).result(30) == 4
    assert clients.start("Odd", "post", 4).result(30) == 5


@pytest.mark.parametrize("name", ["isValid", "metaObject", "call", "told", "registerEvent", "__class__", "_remote"])
def test_what_is_no_method_of_the_service_is_refused(clients, odd, name):
    """Signals of the service, what every object has, and what only a proxy has."""
    for _ in range(2):  # at the second call the service is known
        for arguments in ((), (1,), ("Event", 1, "Odd")):
            with pytest.raises(RuntimeError, match=f"has no method '{name}'"):
                clients.call("Odd", name, *arguments).result(30)
            with pytest.raises(RuntimeError, match=f"has no method '{name}'"):
                clients.post("Odd", name, *arguments)
            with pytest.raises(RuntimeError, match=f"has no method '{name}'"):
                clients.start("Odd", name, *arguments)


@pytest.fixture
def stopped(clients):
    """A client that has registered the service "Stopped" and answers nothing, as one after SIGSTOP."""
    host, port = clients.url.removeprefix("tcp://").split(":")
    with RawPeer((host, int(port))) as peer:
        peer.log_in()
        listed = struct.pack("<I", 1) + text("tcp://127.0.0.1:1")
        info = text("Stopped") + bytes(4) + text("machine") + struct.pack("<I", 1) + listed + text("session") + text("")
        peer.answer(Message(CALL, 1, 1, 104, peer.answer(Message(CALL, 1, 1, 102, info)).payload))
        yield peer


def test_a_client_that_is_stopped_delays_no_other_ones_first_call(clients, stopped, ears, monkeypatch):
    monkeypatch.setattr(client_services, "CALL_TIMEOUT", 3.0)
    hanging = [clients.call("Stopped", "take", number) for number in range(20)]
    assert clients.call("Ears", "take", 0).result(30) == 1
    assert not any(call.done() for call in hanging), "it waited for them"
    asked = stopped.next(CALL)
    for call in hanging:
        with pytest.raises(TimeoutError, match="'Stopped' has not answered"):
            call.result(30)
    stopped.send(Message(CALL, 1, 1, 108, identity=77))
    assert (asked.action, stopped.receive().identity) == (2, 77), "it was asked once, and called by nobody"


def test_calls_that_waited_for_the_client_arrive_in_their_order(clients, qi):
    """The client is asked what its service is like by the first of them."""
    ears, session = _Ears(), qi.Session()
    session.connect(clients.url)
    session.registerService("Ears", ears)
    calls = [clients.call("Ears", "take", number) for number in range(100)]
    assert [call.result(30) for call in calls] == list(range(1, 101))
    assert ears.received == [(number,) for number in range(100)]
    session.close()
