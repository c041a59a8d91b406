"""Calls that wait for pictures: in order, bounded, and on one thread for each subscription."""

import concurrent.futures
import threading

import pytest

from pepper_sim.naoqi.service import ServiceError
from pepper_sim.naoqi.video.calls import PictureCalls


@pytest.fixture
def pool():
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        yield pool


@pytest.fixture
def picture():
    """Work that waits until there is a picture."""
    there = threading.Event()
    yield there
    there.set()


def test_each_call_has_its_turn_and_its_own_error(pool):
    calls, order = PictureCalls(10), []
    done = [calls.run(pool, lambda number=number: order.append(number)) for number in range(5)]
    failed = calls.run(pool, lambda: 1 // 0)
    assert calls.run(pool, lambda: 7).result(30) == 7
    assert all(future.done() for future in done) and order == list(range(5))
    assert isinstance(failed.exception(30), ZeroDivisionError)


def test_who_calls_and_never_reads_holds_up_nobody_else(pool, picture):
    greedy = PictureCalls(3)
    waiting = [greedy.run(pool, lambda: picture.wait(30))]
    while not waiting[0].running():
        picture.wait(0.001)
    waiting += [greedy.run(pool, lambda: picture.wait(30)) for _ in range(3)]
    with pytest.raises(ServiceError, match="3 calls wait for pictures"):
        greedy.run(pool, lambda: None)
    assert PictureCalls(3).run(pool, lambda: "picture").result(30) == "picture"
    waiting[1].cancel()
    greedy.close()
    assert [future.cancelled() for future in waiting] == [False, True, False, False]
    assert waiting[2].result(30) is None and waiting[3].result(30) is None
    picture.set()
    assert waiting[0].result(30) and greedy.run(pool, lambda: 1).result(30) == 1
