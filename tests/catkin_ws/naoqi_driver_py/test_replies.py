"""Replies that no NAOqi sends are refused in one short line, whatever they hold."""

import math

import pytest
from naoqi_driver import replies
from naoqi_driver.replies import MOST_PARTS, UnexpectedReply, bounded


def nested(depth):
    value = []
    for _ in range(depth):
        value = [value]
    return value


NONSENSE = [None, "1 ", b"1", {}, [[]], math.nan, math.inf, -1e300, 2**63, "\x1b[2J" * 1000, object(), nested(500)]


@pytest.mark.parametrize("value", NONSENSE, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize(
    "read",
    [
        lambda value: replies.number(value, "M.m"),
        lambda value: replies.numbers([0.0, value], 2, "M.m"),
        lambda value: replies.numbers(value, 3, "M.m"),
        lambda value: replies.names([value], 5, "M.m"),
    ],
    ids=["number", "one of the numbers", "numbers", "names"],
)
def test_what_is_none_is_refused(read, value):
    with pytest.raises(UnexpectedReply) as refusal:
        read(value)
    assert len(str(refusal.value)) < 250 and str(refusal.value).isprintable()


@pytest.mark.parametrize("value", [[0] * (MOST_PARTS + 1), [[0] * 200] * 200, nested(5000), {"a": nested(50)}])
def test_a_reply_that_is_too_large_or_too_deep_is_refused(value):
    with pytest.raises(UnexpectedReply):
        bounded(value, "M.m")


@pytest.mark.parametrize("value", [None, 7, "text", [1.0] * 500, [["a", [1, 2]], {"b": (3,)}], bytearray(1_000_000)])
def test_what_robots_do_send_passes(value):
    assert bounded(value, "M.m") is value
