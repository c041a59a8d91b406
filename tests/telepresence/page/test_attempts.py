"""How often somebody may try. Times are invented."""

import pytest

from telepresence.page import attempts as module
from telepresence.page.attempts import MOST, PERIOD, Attempts, network


def test_it_fills_again_little_by_little():
    attempts = Attempts()
    tried = [now for now in range(600) if attempts.wait("x", now) == 0.0 and attempts.note("x", now) is None]
    assert tried[: MOST - 1] == list(range(MOST - 1)) and len(tried) == pytest.approx(MOST + 600 * MOST / PERIOD, abs=2)
    assert attempts.wait("y", 600.0) == 0.0
    wait = attempts.wait("x", 600.0)
    assert attempts.wait("x", 600.0 + wait) == 0.0


def test_who_is_right_is_not_counted():
    attempts = Attempts()
    for _ in range(100):
        assert attempts.wait("x", 0.0) == 0.0
        attempts.note("x", 0.0)
        attempts.forgive("x", 0.0)


def test_what_is_known_has_an_end(monkeypatch):
    monkeypatch.setattr(module, "MOST_KNOWN", 3)
    attempts = Attempts()
    for number in range(1000):
        attempts.note(str(number), 0.0)
    assert len(attempts._left) == 3


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("192.0.2.1", "192.0.2.2", False),
        ("192.0.2.1", "::ffff:192.0.2.1", True),
        ("2001:db8::1", "2001:db8::ffff", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("fe80::1%eth0", "fe80::1", True),
    ],
)
def test_a_household_counts_as_one(one, other, same):
    assert (network(one) == network(other)) is same
