"""What is asked of a drive server, answered by hand."""

from __future__ import annotations

import math
import threading

import pytest

from telepresence.drive.datagram import Report
from telepresence.drive.pilots_requests import Done, PilotsRequests

NEVER = 0.0


def report(started: float | None, state: str = "no command", reason: str = "") -> Report:
    """Return a report of the server that began at this time [s]."""
    return Report(9.0, 1, state, reason, (0.0, 0.0, 0.0), (), math.inf, -1, math.inf, False, None, started)


@pytest.fixture
def requests(wait_until):
    """Requests, and somebody who asks and gets the answer that a test gives."""
    requests = PilotsRequests("anna@desk")

    def do(what: str) -> None:
        done: list[Done | None] = []
        asking = threading.Thread(target=lambda: done.append(requests.ask(what, 30.0)))
        asking.start()
        wait_until(lambda: what in [asked for _, asked in requests.waiting()], "it is asked")
        number = max(number for number, asked in requests.waiting() if asked == what)
        requests.answer(number, Done(True, "done"))
        asking.join()
        assert done == [Done(True, "done")] and number not in dict(requests.waiting())

    requests.do = do
    return requests


def asked(requests: PilotsRequests) -> list[str]:
    return [what for _, what in requests.waiting()]


def test_what_is_not_answered_is_given_up(requests):
    assert requests.ask("stop", NEVER) is None and asked(requests) == []


def test_an_answer_that_nobody_waits_for_is_dropped(requests):
    requests.answer(7, Done(True, ""))
    assert requests.ask("stop", NEVER) is None


def test_a_server_that_began_later_is_asked_for_the_stop(requests):
    requests.report(report(1.0))
    requests.do("stop")
    requests.report(report(1.0, "stopped"))
    requests.report(report(2.0, "fault"))
    requests.report(report(2.0))
    assert asked(requests) == ["stop"]
    (number, _), *_ = requests.waiting()
    requests.answer(number, Done(True, ""))
    requests.report(report(2.0, "stopped"))
    assert asked(requests) == []
    requests.report(report(3.0))
    assert asked(requests) == ["stop"], "and so is the one after that"


@pytest.mark.parametrize(
    ("reason", "wanted"),
    [
        ("Stopped: anna@desk at 10.8.0.2 pressed stop. Reset to go on.", ["stop"]),
        ("Stopped: ben@desk at 10.8.0.3 pressed stop. Reset to go on.", []),
        ("Let go of the controls once.", []),
    ],
)
def test_a_stop_that_this_pilot_had_asked_for_before_outlives_the_server_too(requests, reason, wanted):
    """The link that asked for it has died; who else has pressed stop, or reset it, is asked by nobody else."""
    requests.report(report(1.0, "stopped", reason))
    requests.report(report(2.0))
    assert asked(requests) == wanted


@pytest.mark.parametrize("state", ["no command", "clear", "limited"])
def test_a_stop_that_another_pilot_has_reset_is_over(requests, state):
    requests.report(report(1.0))
    requests.do("stop")
    requests.report(report(1.0, "stopped"))
    requests.report(report(1.0, state))
    requests.report(report(2.0))
    assert asked(requests) == []


def test_a_fault_is_no_reset(requests):
    requests.report(report(1.0))
    requests.do("stop")
    requests.report(report(1.0, "fault"))
    requests.report(report(2.0))
    assert asked(requests) == ["stop"]


def test_who_resets_the_stop_no_longer_asks_for_it(requests):
    requests.report(report(1.0))
    requests.do("stop")
    requests.report(report(2.0))
    requests.do("reset stop")
    requests.report(report(2.0))
    assert asked(requests) == []
    requests.report(report(3.0))
    assert asked(requests) == []


def test_a_reset_that_waits_for_the_next_server_counts(requests, wait_until):
    requests.report(report(1.0))
    requests.do("stop")
    asking = threading.Thread(target=requests.ask, args=("reset stop", 30.0))
    asking.start()
    wait_until(lambda: asked(requests) == ["reset stop"], "it is asked of nobody yet")
    requests.report(report(2.0))
    assert asked(requests) == ["reset stop"]
    ((number, _),) = requests.waiting()
    requests.answer(number, Done(True, ""))
    asking.join()
    requests.report(report(3.0))
    assert asked(requests) == []


def test_a_server_that_does_not_say_when_it_began_is_taken_for_the_same(requests):
    requests.report(report(None))
    requests.do("stop")
    requests.report(report(None, "stopped"))
    requests.report(report(None))
    assert asked(requests) == []


def test_a_reset_that_waits_gives_way_to_a_stop(requests, wait_until):
    done: list[Done | None] = []
    asking = threading.Thread(target=lambda: done.append(requests.ask("reset stop", 30.0)))
    asking.start()
    wait_until(lambda: asked(requests) == ["reset stop"], "the reset is asked")
    requests.do("stop")
    asking.join(10.0)
    assert done == [None] and asked(requests) == [], "it is not repeated after the stop"
