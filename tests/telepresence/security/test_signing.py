"""Numbered, signed messages: what was changed, repeated or meant for something else does not count."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.security.signing import PROOF, SEAL, Check, PreparedKey, Received, mac, nonce, seal, session_key, sign

KEY = session_key(b"shared", "test", bytes(16), bytes(range(16)))


def test_a_sealed_message_is_received_once():
    received = Received(KEY)
    first, second = seal(KEY, "p", 1, b"one"), seal(KEY, "p", 2, b"two")
    assert len(first) == SEAL + 3
    assert received.unseal("p", second) == b"two"
    assert received.unseal("p", second) is None, "repeated"
    assert received.unseal("p", first) is None, "older"
    assert Received(KEY).unseal("p", first) == b"one"


def test_what_was_signed_for_one_purpose_session_or_key_counts_for_no_other():
    sealed = seal(KEY, "to the robot", 1, b"go")
    assert Received(KEY).unseal("to the pilot", sealed) is None
    other = session_key(b"shared", "test", bytes(16), bytes(16))
    assert Received(other).unseal("to the robot", sealed) is None
    assert Received(session_key(b"", "test", bytes(16), bytes(range(16)))).unseal("to the robot", sealed) is None


def test_purposes_are_counted_apart():
    received = Received(KEY)
    assert received.check(sign(KEY, "a", 9, b""), "a", 9, b"") is Check.GOOD
    assert received.check(sign(KEY, "b", 1, b""), "b", 1, b"") is Check.GOOD
    assert received.check(sign(KEY, "a", 9, b""), "a", 9, b"") is Check.REPEATED
    assert received.check(bytes(PROOF), "a", 10, b"") is Check.FORGED
    assert received.check(sign(KEY, "a", 10, b""), "a", 10, b"") is Check.GOOD, "a forgery uses no number up"


@pytest.mark.parametrize("number", [-1, 0, 1 << 63, 1 << 400])
def test_numbers_out_of_range_never_count(number):
    assert Received(KEY).check(bytes(PROOF), "a", number) is Check.FORGED
    if number == 0:
        assert Received(KEY).unseal("a", seal(KEY, "a", 0, b"x")) is None


@given(st.lists(st.binary(max_size=6), max_size=4), st.lists(st.binary(max_size=6), max_size=4))
def test_no_two_lists_of_parts_sign_alike(one, other):
    assert (mac(KEY, "p", *one) == mac(KEY, "p", *other)) == (one == other)


@given(st.binary(max_size=100), st.lists(st.binary(max_size=6), max_size=4))
def test_a_prepared_key_signs_again_and_again_as_the_key_itself(key, parts):
    prepared = PreparedKey(key)
    for _ in range(2):
        assert mac(prepared, "p", *parts) == mac(key, "p", *parts)


@given(st.integers(min_value=0), st.integers(0, 7), st.integers(0, 40))
def test_any_flipped_bit_and_any_missing_end_is_found(place, bit, shorter):
    sealed = bytearray(seal(KEY, "p", 7, b"a short body"))
    cut = bytes(sealed[: len(sealed) - shorter])
    assert Received(KEY).unseal("p", cut) == (b"a short body" if shorter == 0 else None)
    sealed[place % len(sealed)] ^= 1 << bit
    assert Received(KEY).unseal("p", bytes(sealed)) is None


def test_nonces_are_new_each_time():
    assert len({nonce() for _ in range(100)}) == 100
