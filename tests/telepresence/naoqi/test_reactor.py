"""The I/O thread and the workers: nothing is lost, nobody waits for a slow one, and all of it ends."""

from __future__ import annotations

import itertools
import os
import socket
import threading

import pytest
from waiting import wait_until

from telepresence.naoqi import workers
from telepresence.naoqi.future import Future
from telepresence.naoqi.reactor import READ, reactor

PATIENCE = 20.0


def test_no_wake_up_is_lost() -> None:
    """Each caller waits for its turn before it asks again, so one lost wake-up stops it for good."""

    def ask() -> None:
        for _ in range(500):
            turn = threading.Event()
            reactor().call_soon(turn.set)
            assert turn.wait(PATIENCE)

    callers = [threading.Thread(target=ask) for _ in range(3)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join(PATIENCE)
    assert not any(caller.is_alive() for caller in callers)


def test_timers_come_in_their_order_and_can_be_cancelled() -> None:
    """By when they are due: a machine that holds the caller up between two of them makes a later one due first."""
    seen: list[str] = []
    last = threading.Event()
    timers = {
        name: reactor().call_later(seconds, seen.append, name)
        for name, seconds in (("third", 0.06), ("first", 0.02), ("second", 0.04))
    }
    reactor().call_later(0.03, seen.append, "cancelled").cancel()
    reactor().call_later(0.1, lambda: last.set())
    assert last.wait(PATIENCE)
    wait_until(lambda: len(seen) == 3, "a timer is missing")
    assert seen == sorted(timers, key=lambda name: timers[name].due)


def test_a_handler_that_fails_stops_nobody(caplog: pytest.LogCaptureFixture) -> None:
    one, other = socket.socketpair()
    with one, other:

        def fail(_mask: int) -> None:
            one.recv(1)
            raise ValueError("of the test")

        reactor().run(reactor().watch, one, READ, fail)
        other.send(b"x")
        wait_until(lambda: "of the test" in caplog.text, "the failure is not logged")
        assert reactor().run(lambda: 5) == 5
        with pytest.raises(ZeroDivisionError):
            reactor().run(lambda: 1 // 0)
        reactor().run(reactor().unwatch, one)


def test_a_forked_child_has_its_own() -> None:
    reactor().run(lambda: None)
    child = os.fork()
    if not child:
        os._exit(0 if reactor().run(lambda: 7) == 7 else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert reactor().run(lambda: 8) == 8


def test_workers_that_block_are_joined_by_others_and_leave_when_idle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "IDLE_S", 0.1)
    pool, gate, ran = workers.Workers(), threading.Event(), threading.Event()
    before = threading.active_count()
    for _ in range(3 * workers.FEW):
        pool.submit(gate.wait, PATIENCE)
    pool.submit(ran.set)
    assert ran.wait(PATIENCE), "a task waits for twelve that block"
    gate.set()
    wait_until(lambda: threading.active_count() <= before, "idle workers stay")


def test_workers_that_wait_for_each_other_do_not_lock_up() -> None:
    """Each task waits for a future that a task behind it completes: as methods that call their callers back."""
    depth = workers.MOST // 2
    futures = [Future() for _ in range(depth + 1)]
    for earlier, later in itertools.pairwise(futures):
        workers.submit(lambda earlier=earlier, later=later: earlier.finish_with_value(later.value(PATIENCE * 1000)))
    workers.submit(futures[-1].finish_with_value, 42)
    assert futures[0].value(PATIENCE * 1000) == 42


def test_a_strand_keeps_the_order_and_runs_one_at_a_time() -> None:
    strand, seen, busy, done = workers.Strand(), [], threading.Lock(), threading.Event()

    def task(number: int) -> None:
        assert busy.acquire(blocking=False), "two at a time"
        seen.append(number)
        busy.release()

    for number in range(500):
        strand.submit(task, number)
    strand.submit(lambda: 1 // 0)  # is logged
    strand.submit(done.set)
    assert done.wait(PATIENCE) and seen == list(range(500))
