"""What a browser sends: what our page says is understood, and nothing else."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.page.commands import LONGEST, REQUESTS, BadMessage, parse_ask, parse_drive, parse_look
from telepresence.teleop.looking import Look, Manner

DRIVE = {"n": 17, "t": 12.35, "v": [0.2, 0.0, -0.5], "hold": ""}
ASK = {"id": 3, "do": "take", "with": None}
VALUES = {"give": "ben", "small_picture": True, "listen": True, "face": False, "say": "Hello."}
"""What requests are made with; null for the others."""
anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
)


def test_a_velocity_and_a_sign_of_life_are_understood():
    message = parse_drive(json.dumps(DRIVE))
    assert (message.number, message.sent, tuple(message.velocity), message.hold) == (17, 12.35, (0.2, 0.0, -0.5), "")
    assert parse_drive(json.dumps(DRIVE | {"v": None, "hold": "The page is hidden."})).velocity is None


@pytest.mark.parametrize("action", REQUESTS)
def test_requests_are_understood(action):
    value = VALUES.get(action)
    message = parse_ask(json.dumps(ASK | {"do": action, "with": value}))
    assert (message.number, message.action, message.value) == (3, action, value)


@pytest.mark.parametrize(
    "change",
    [
        {"n": 0}, {"n": -1}, {"n": 1.5}, {"n": True}, {"n": 2**53}, {"t": "now"}, {"t": math.nan}, {"t": math.inf},
        {"t": 10**400}, {"v": [1, 2]}, {"v": [1, 2, "3"]}, {"v": [math.nan, 0, 0]}, {"v": [3.0, 0, 0]}, {"v": 1},
        {"v": [2.0, 2.0, 0]}, {"v": [0, 0, 7]}, {"v": [True, 0, 0]}, {"hold": None}, {"hold": "x" * 201},
        {"hold": "a\nb"}, {"more": 1},
    ],
)  # fmt: skip
def test_what_no_page_of_ours_says_is_refused(change):
    with pytest.raises(BadMessage):
        parse_drive(json.dumps(DRIVE | change))


@pytest.mark.parametrize(
    "change", [{"do": "leave"}, {"do": ""}, {"do": 1}, {"with": 1}, {"id": 0}, {"id": "1"}, {"x": 1}]
)
def test_requests_that_no_page_of_ours_makes_are_refused(change):
    with pytest.raises(BadMessage):
        parse_ask(json.dumps(ASK | change))


def test_lengths_and_depths_have_an_end():
    for text in ("[" * LONGEST, json.dumps(DRIVE | {"hold": "x"}) + " " * LONGEST, b"{}", "", "null"):
        with pytest.raises(BadMessage):
            parse_drive(text)


@given(
    st.one_of(
        st.text(), anything.map(json.dumps), st.fixed_dictionaries({key: anything for key in DRIVE}).map(json.dumps)
    )
)
def test_nothing_but_a_refusal_comes_of_anything(text):
    for parse in (parse_drive, parse_ask):
        try:
            message = parse(text)
        except BadMessage as error:
            assert 0 < len(str(error)) < 200
        else:
            assert message.number > 0


def test_a_look_is_a_manner_with_angles_where_it_has_some():
    assert parse_look('{"n": 1, "t": 2.5, "do": "goal", "at": [0.5, -0.1]}').look == Look(Manner.GOAL, 0.5, -0.1)
    assert parse_look('{"n": 1, "t": 2.5, "do": "way", "at": null}').look == Look(Manner.WAY)


@pytest.mark.parametrize(
    "fields",
    [
        '"do": "goal", "at": null', '"do": "ahead", "at": [0, 0]', '"do": "goal", "at": [0, 4]',
        '"do": "rate", "at": [0]', '"do": "rate", "at": [NaN, 0]', '"do": "nod", "at": null', '"do": 1, "at": null',
    ],
)  # fmt: skip
def test_what_is_no_look_is_refused(fields):
    with pytest.raises(BadMessage):
        parse_look(f'{{"n": 1, "t": 2.5, {fields}}}')
