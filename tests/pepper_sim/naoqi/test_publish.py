"""Services as the server offers them: signatures, errors, long calls, cancel."""

import concurrent.futures
import threading
import time

import pytest
from naoqi_clients import with_both_clients

from pepper_sim.naoqi.publish import served_object
from pepper_sim.naoqi.service import Service, ServiceError, remote
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
