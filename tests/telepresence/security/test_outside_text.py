"""Text from outside, made plain."""

import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telepresence.security.outside_text import LONGEST_LOG, PlainRecord, clean, clean_name


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("anna's robot <b>& Zoë 机器人 🤖", "anna's robot <b>& Zoë 机器人 🤖"),
        ("one\ntwo\tthree\u00a0four\u2028five", "one two three four five"),
        ("\x1b[2J\x9b31m\x00", "\ufffd[2J\ufffd31m\ufffd"),
        ("\u202ereversed\u2066\u200b\ufeff", "reversed"),
        ("\ud800", "\ufffd"),
        (b"bytes", "b'bytes'"),
        (ValueError("\x07"), "\ufffd"),
        ("", ""),
    ],
)
def test_what_is_shown(text, shown):
    assert clean(text) == shown


def test_line_ends_are_kept_on_request_only():
    assert clean("a\r\nb", lines=True) == "a \nb"


def test_what_is_too_long_ends_with_an_ellipsis():
    assert clean("x" * 10_000_000, 5) == "xxxx…"
    assert len(clean_name("x" * 100)) == 60


@given(st.text(st.characters()), st.integers(1, 50))
def test_everything_becomes_printable_and_stays_so(text, longest):
    shown = clean(text, longest)
    assert shown.isprintable() and len(shown) <= longest
    assert clean(shown, longest) == shown


def record(message, *arguments, **more):
    return PlainRecord("robot", logging.ERROR, __file__, 1, message, arguments, None, **more)


def test_a_log_line_is_plain_with_arguments_and_traceback():
    try:
        raise ValueError("\x1b]0;owned\x07")
    except ValueError as error:
        failed = PlainRecord("robot", logging.ERROR, __file__, 1, "it failed: %s", ("\x1b[2J",),
                             (type(error), error, error.__traceback__))  # fmt: skip
    text = logging.Formatter().format(failed)
    assert text.startswith("it failed: \ufffd[2J\nTraceback") and text.endswith("ValueError: \ufffd]0;owned\ufffd")


def test_a_log_line_has_no_field_of_the_formatter_of_ros_and_no_end_of_its_own():
    assert record("%s", "${walltime:").getMessage() == "$ {walltime:"
    assert len(record("x" * 10_000).getMessage()) == LONGEST_LOG
