"""Services as the server offers them: signatures, errors, long calls, cancel."""

import concurrent.futures
import threading
import time

import pytest
from naoqi_clients import with_both_clients

from pepper_sim.naoqi import posted_calls
from pepper_sim.naoqi.publish import served_object
from pepper_sim.naoqi.service import Module, Service, ServiceError, remote
from telepresence.naoqi.server import Server
from telepresence.naoqi.signals import Signal

pytestmark = with_both_clients


class _Slow(Service):
    name = "Slow"

    def __init__(self):
        self.pending: list[concurrent.futures.Future] = []
        self.changed = Signal("(s)")
        self._hidden = Signal("(s)")

    @remote("b(f)")
    def drive(self, x: float) -> concurrent.futures.Future:
        """Drives."""
        self.pending.append(concurrent.futures.Future())
        return self.pending[-1]

    @remote("v()")
    def stop(self) -> None:
        for future in self.pending:
            if not future.done():
                future.set_result(False)

    @remote("i()")
    def number(self) -> int:
        return 7

    @remote("m(s)")
    def refuse(self, why: str) -> None:
        raise ServiceError(why)


@pytest.fixture
def slow(qi):
    service = _Slow()
    server = Server("tcp://127.0.0.1:0")
    server.register("Slow", served_object(service))
    server.start()
    client = qi.Session()
    client.connect(server.endpoints[-1])
    yield service, client.service("Slow")
    client.close()
    server.close()


def test_metaobject_shows_declared_methods_and_signals_only(slow):
    meta = slow[1].metaObject()
    methods = {m["name"]: m for uid, m in meta["methods"].items() if uid >= 100}
    assert set(methods) == {"drive", "stop", "number", "refuse"}
    assert methods["drive"]["parametersSignature"] == "(f)" and methods["drive"]["returnSignature"] == "b"
    assert methods["drive"]["description"] == "Drives."
    assert "changed" in {s["name"] for s in meta["signals"].values()}
    assert "_hidden" not in {s["name"] for s in meta["signals"].values()}


def test_long_calls_do_not_keep_others_waiting(slow):
    _, proxy = slow
    calls = [proxy.drive(1.0, _async=True) for _ in range(20)]
    assert proxy.number() == 7
    proxy.stop()
    assert [call.value(5000) for call in calls] == [False] * 20


def test_an_error_is_one_line_of_text(slow, refused):
    assert refused(slow[1].refuse, "not today") == "Slow::refuse: not today"


def test_an_error_of_a_long_call_reaches_the_client(slow, wait_until):
    service, proxy = slow
    call = proxy.drive(1.0, _async=True)
    wait_until(lambda: service.pending, "the call arrived")
    service.pending[0].set_exception(ServiceError("the wheel came off"))
    call.wait(5000)
    assert call.error() == "Slow::drive: the wheel came off"


def test_cancelling_a_call_cancels_the_work(slow, wait_until):
    service, proxy = slow
    call = proxy.drive(1.0, _async=True)
    wait_until(lambda: service.pending, "the call arrived")
    call.cancel()
    wait_until(lambda: service.pending[0].cancelled(), "the work was cancelled")


def test_finished_calls_are_forgotten(slow):
    """Neither the server nor the future keeps the other alive."""
    import gc
    import weakref

    service, proxy = slow
    call = proxy.drive(1.0, _async=True)
    while not service.pending:
        time.sleep(0.01)
    reference = weakref.ref(service.pending[0])
    service.pending.pop().set_result(True)
    assert call.value(5000) is True
    del call
    deadline = threading.Event()
    for _ in range(100):
        gc.collect()
        if reference() is None:
            return
        deadline.wait(0.02)
    pytest.fail("the future is still alive")


class _Walker(Module):
    """Walks until the test lets it arrive, or somebody stops it."""

    name = "Walker"

    def __init__(self):
        self.walks: list[concurrent.futures.Future] = []

    @remote("v(i)", "v(s)")
    def walk(self, where: object) -> concurrent.futures.Future:
        self.walks.append(concurrent.futures.Future())
        return self.walks[-1]

    @remote("v()")
    def halt(self) -> None:
        """Fails."""
        raise ServiceError("it cannot")


@pytest.fixture
def walker(qi):
    service = _Walker()
    with Server("tcp://127.0.0.1:0") as server:
        server.register("Walker", served_object(service))
        client = qi.Session()
        client.connect(server.endpoints[-1])
        yield service, client.service("Walker")
        client.close()


def test_a_posted_call_runs_while_its_caller_goes_on(walker):
    service, client = walker
    numbers = [client.pCall(["walk", 1]), client.pCall(["walk", "home"])]
    assert len(set(numbers)) == 2 and [client.isRunning(number) for number in numbers] == [True, True]
    assert client.wait(numbers[0], 20) is True, "the time-out comes first"
    waiting = [client.wait(numbers[0], 30_000, _async=True), client.wait(numbers[0], _async=True)]
    assert all(call.isRunning() for call in waiting)
    service.walks[0].set_result(None)
    assert [call.value(30_000) for call in waiting] == [False, None]
    assert [client.isRunning(number) for number in numbers] == [False, True]
    assert client.wait(numbers[0], 20) is False and client.wait(numbers[0]) is None
    client.stop(numbers[1])
    assert service.walks[1].cancelled() and not client.isRunning(numbers[1])
    client.stop(numbers[1])


def test_a_wait_that_is_cancelled_leaves_the_call_alone(walker, wait_until):
    service, client = walker
    number = client.pCall(["walk", 1])
    waiting = client.wait(number, 0, _async=True)
    waiting.cancel()
    wait_until(lambda: not waiting.isRunning(), "the wait ended")
    assert client.isRunning(number) and not service.walks[0].cancelled()


def test_a_posted_call_that_fails_is_over(walker, wait_until):
    service, client = walker
    assert client.isRunning(client.pCall(["halt"])) is False
    number = client.pCall(["walk", 1])
    service.walks[0].set_exception(ServiceError("there is a wall"))
    wait_until(lambda: not client.isRunning(number), "it is over")


def test_what_cannot_be_posted_is_refused(walker, refused, monkeypatch):
    _, client = walker
    for call in ("halt", [], [3], ["fly"], ["walk"], ["walk", 1, 2], ["pCall", ["halt"]]):
        assert "there is no method" in (said := refused(client.pCall, call)) or "is a list of" in said
    assert "there is no method 7" in refused(client.call, "__pCall", 7, [])
    monkeypatch.setattr(posted_calls, "MOST", 2)
    numbers = [client.pCall(["walk", 1]) for _ in range(2)]
    assert "2 posted calls are running already" in refused(client.pCall, ["walk", 1])
    client.stop(numbers[0])
    assert client.pCall(["walk", 1])


def test_modules_number_what_they_inherit_as_robots_do(walker):
    """A method is posted by the number under which the metaobject lists it."""
    _, client = walker
    methods = {(m["name"], m["parametersSignature"]): m for m in client.metaObject()["methods"].values()}
    assert {key: methods[key]["uid"] for key in (("exit", "()"), ("pCall", "(m)"), ("getUsage", "(s)"))} == {
        ("exit", "()"): 100,
        ("pCall", "(m)"): 102,
        ("getUsage", "(s)"): 113,
    }
    assert (methods["__pCall", "(I[m])"]["uid"], methods["__pCall", "(I[m])"]["returnSignature"]) == (101, "i")
    walk = methods["walk", "(i)"]["uid"]
    assert walk >= 114
    assert client.isRunning(client.call("__pCall", walk, [1])) is True
