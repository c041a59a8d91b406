"""Datagrams between pilot and drive server: what is understood, and what is refused."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given as fed
from hypothesis import settings
from hypothesis import strategies as st

from telepresence.drive import datagram
from telepresence.drive.datagram import (
    BadMessage,
    Drive,
    Goal,
    GoalState,
    Report,
    decode,
    encode,
    parse_for_robot,
    parse_report,
)
from telepresence.drive.session import MAX_BODY

DRIVE = {"type": "drive", "echo": 10.5, "after": 0.1, "velocity": [0.1, 0, -0.2]}


def test_messages_survive_the_wire():
    assert parse_for_robot(encode(**DRIVE, careful=True)) == Drive(10.5, 0.1, (0.1, 0.0, -0.2), True, None, False)
    assert parse_for_robot(encode(**{**DRIVE, "velocity": None})).velocity is None
    goal = {"id": 7, "pose": [1, -0.5, 3.1]}
    assert parse_for_robot(encode(**DRIVE, goal=goal)).goal == Goal(7, (1.0, -0.5, 3.1))


REPORT = Report(
    1234567.123456789, 2**40, "sensor stale", "x" * 300, (-0.1999, -0.1999, -1.9999), (10.19,) * 72,
    math.inf, -1, math.inf, True, GoalState(2**52, "driving"), 1234567.123,
)  # fmt: skip


_FINITE = st.floats(-datagram.LARGEST, datagram.LARGEST)


@fed(_FINITE, _FINITE, st.tuples(_FINITE, _FINITE, _FINITE | st.integers(-9, 9)), st.booleans())
def test_a_velocity_from_the_template_is_what_encode_makes_of_it(echo, after, velocity, careful):
    body = datagram.encode_velocity(echo, after, velocity, careful)
    assert parse_for_robot(body) == Drive(echo, after, velocity, careful, None, False)
    assert parse_for_robot(body) == parse_for_robot(
        encode(type="drive", echo=echo, after=after, velocity=velocity, careful=careful, goal=None, hard=False)
    )


def test_a_report_fits_one_datagram_and_survives():
    body = datagram.encode_report(REPORT)
    assert len(body) <= MAX_BODY
    assert parse_report(decode(body)) == REPORT
    ungated = REPORT._replace(allowed=(), goal=None, started=None)
    assert parse_report(decode(datagram.encode_report(ungated))) == ungated


@pytest.mark.parametrize("letter", ['"', "\\", "ü", "\U0001f916", "\0", "\ud800"])
def test_whatever_letters_its_reason_has_a_report_fits(letter):
    body = datagram.encode_report(REPORT._replace(reason=letter * 500))
    assert len(body) <= MAX_BODY
    assert parse_report(decode(body)).reason.isprintable()


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("allowed", [0.1] * 71),
        ("allowed", None),
        ("goal", {"id": 1, "state": "lost"}),
        ("sector", 72),
        ("sector", 70000),
        ("stamp", "now"),
        ("given", [1]),
    ],
)
def test_a_report_that_no_message_could_hold_is_refused(field, value):
    with pytest.raises(BadMessage):
        parse_report({**decode(datagram.encode_report(REPORT)), field: value})


def test_control_characters_of_the_robot_reach_no_terminal():
    fields = {**decode(datagram.encode_report(REPORT)), "reason": "a\x1b[2Jb\rc\u202ed", "state": "clear\n"}
    assert parse_report(fields)[2:4] == ("clear ", "a [2Jb c d")


@pytest.mark.parametrize(
    "datagram",
    [
        b"",
        b"\xff\xfe",
        b"[1, 2]",
        b'"drive"',
        b'{"type": 1}',
        b'{"type": "fly"}',
        b'{"type": "report"}',
        b"[" * 1000,
        b'{"type": "ask", "id": 1, "what": "stop"}' + b" " * 2000,
        b'{"type": "ask", "id": 1.5, "what": "stop"}',
        b'{"type": "ask", "id": 1e400, "what": "stop"}',
    ],
)
def test_what_is_no_message_is_refused(datagram):
    with pytest.raises(BadMessage):
        parse_for_robot(datagram)


@pytest.mark.parametrize(
    ("field", "text"),
    [
        ("velocity", "[NaN, 0, 0]"),
        ("velocity", "[Infinity, 0, 0]"),
        ("velocity", "[1e999, 0, 0]"),
        ("velocity", "[0, 0]"),
        ("velocity", '["0", 0, 0]'),
        ("velocity", "[true, 0, 0]"),
        ("velocity", "0.1"),
        ("velocity", "[" + "9" * 500 + ", 0, 0]"),
        ("echo", "null"),
        ("after", '"soon"'),
        ("careful", "1"),
        ("goal", "1"),
        ("goal", '{"id": 1}'),
        ("goal", '{"id": 1, "pose": [0, NaN, 0]}'),
    ],
)
def test_a_command_with_a_bad_value_is_refused(field, text):
    fields = {**DRIVE, field: "HERE"}
    with pytest.raises(BadMessage):
        parse_for_robot(json.dumps(fields).replace('"HERE"', text).encode())


@settings(max_examples=60)
@fed(
    st.one_of(
        st.binary(max_size=200),
        st.dictionaries(
            st.sampled_from(["type", "echo", "after", "velocity", "id", "what", "careful"]),
            st.recursive(
                st.none() | st.booleans() | st.floats() | st.integers() | st.sampled_from(["drive", "ask", "stop"]),
                lambda inner: st.lists(inner, max_size=4),
                max_leaves=6,
            ),
        ).map(lambda fields: json.dumps(fields).encode()),
    )
)
def test_nothing_else_can_come_of_a_datagram(datagram):
    try:
        message = parse_for_robot(datagram)
    except BadMessage:
        return
    if isinstance(message, Drive) and message.velocity is not None:
        assert all(map(math.isfinite, message.velocity))
