"""Datagrams between pilot and drive server: what is understood, and what is refused."""

from __future__ import annotations

import json
import math

import pytest
from hypothesis import given as fed
from hypothesis import settings
from hypothesis import strategies as st
from rto_node import drive_datagram
from rto_node.drive_datagram import BadMessage, Drive, Hello, Report, decode, encode, parse_for_robot, parse_report

DRIVE = {"type": "drive", "session": "s", "seq": 1, "echo": 10.5, "after": 0.1, "velocity": [0.1, 0, -0.2]}


def test_messages_survive_the_wire():
    assert parse_for_robot(encode(type="hello")) == Hello()
    assert parse_for_robot(encode(**DRIVE, careful=True)) == Drive("s", 1, 10.5, 0.1, (0.1, 0.0, -0.2), True)
    assert parse_for_robot(encode(**{**DRIVE, "velocity": None})).velocity is None


def test_a_report_fits_one_datagram_and_survives():
    given, allowed = (0.19, -0.1, 1.0), (0.196,) * 72
    report = Report(
        1234567.123456789, 2**40, "sensor stale", "x" * 300, given, allowed, math.inf, -1, math.inf, True
    )  # fmt: skip
    datagram = drive_datagram.encode_report(report)
    assert len(datagram) < drive_datagram.MAX_DATAGRAM
    got = parse_report(decode(datagram))
    assert got._replace(allowed=()) == report._replace(allowed=())
    assert got.allowed == pytest.approx((0.2,) * 72)


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
        b'{"type": "hello"}' + b" " * 2000,
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
        ("seq", "1.5"),
        ("seq", "1e400"),
        ("echo", "null"),
        ("after", '"soon"'),
        ("session", "7"),
        ("careful", "1"),
    ],
)
def test_a_command_with_a_bad_value_is_refused(field, text):
    fields = {**DRIVE, field: "HERE"}
    with pytest.raises(BadMessage):
        parse_for_robot(json.dumps(fields).replace('"HERE"', text).encode())


@settings(max_examples=300)
@fed(
    st.one_of(
        st.binary(max_size=200),
        st.dictionaries(
            st.sampled_from(["type", "session", "seq", "echo", "after", "velocity", "id", "what", "careful"]),
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
