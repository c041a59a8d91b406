from __future__ import annotations

import pytest

from telepresence.web.origin import foreign
from telepresence.web.page_auth import SECONDS_PER_TRY, TRIES, PageAuth, Refused, make_token


def status(auth: PageAuth, address: str, now: float, *keys: str | None) -> int:
    try:
        auth.check_key(address, now, *keys)
    except Refused as refused:
        return refused.status
    return 200


def test_without_a_token_everybody_may_come_in() -> None:
    assert status(PageAuth(), "10.0.0.1", 0.0, None, None) == 200


def test_the_key_counts_in_the_address_and_in_the_cookie() -> None:
    auth = PageAuth("secret")
    assert status(auth, "a", 0.0, "secret", None) == 200
    assert status(auth, "a", 0.0, None, "secret") == 200
    assert status(auth, "a", 0.0, "secret", "of an earlier run") == 200
    assert status(auth, "a", 0.0, None, None) == 403
    assert status(auth, "a", 0.0, "secre", "") == 403
    assert status(auth, "a", 0.0, "sécret") == 403


def test_guessing_is_slowed_down_for_one_address_only() -> None:
    auth = PageAuth("secret")
    assert [status(auth, "thief", 0.0, f"guess {n}") for n in range(TRIES + 3)] == [403] * TRIES + [429] * 3
    assert status(auth, "thief", 0.0, "secret") == 429, "the right guess among too many is not told from a wrong one"
    assert status(auth, "robot", 0.0, "secret") == 200
    assert status(auth, "thief", SECONDS_PER_TRY, "secret") == 200


def test_asking_without_a_key_costs_no_try() -> None:
    auth = PageAuth("secret")
    assert [status(auth, "a", 0.0) for _ in range(3 * TRIES)] == [403] * 3 * TRIES
    assert status(auth, "a", 0.0, "secret") == 200


def test_a_tablet_that_keeps_sending_yesterdays_cookie_is_not_locked_out() -> None:
    auth = PageAuth("today")
    assert {status(auth, "robot", 5.0 * n, None, "yesterday") for n in range(100)} == {403}
    assert status(auth, "robot", 500.0, "today", "yesterday") == 200


def test_many_addresses_take_no_memory() -> None:
    auth = PageAuth("secret")
    for n in range(5000):
        status(auth, str(n), 0.0, "wrong")
    assert len(auth._failures) <= 1000


@pytest.mark.parametrize(
    "host", ["127.0.0.1:10002", "192.168.1.5", "[::1]:10002", "::1", "localhost:1", "Pilot-PC:10002", "LOCALHOST", ""]
)
def test_our_own_names_are_accepted(host: str) -> None:
    assert foreign({"HTTP_HOST": host}, PageAuth(hosts=["pilot-pc"]).names) is None


@pytest.mark.parametrize("host", ["evil.example", "evil.example:10002", "127.0.0.1.evil.example", "localhost.evil:1"])
def test_a_strangers_name_for_our_address_is_refused(host: str) -> None:
    assert "evil" in foreign({"HTTP_HOST": host}, PageAuth(hosts=["pilot-pc"]).names)


def test_tokens_differ_and_fit_into_an_address() -> None:
    tokens = {make_token() for _ in range(100)}
    assert len(tokens) == 100
    assert all(len(token) >= 22 and token.replace("-", "").replace("_", "").isalnum() for token in tokens)
