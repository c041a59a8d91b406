import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotino_sim.json_body import (
    BadRequest,
    boolean,
    booleans,
    from_json,
    index,
    member,
    number,
    numbers,
    text,
    to_json,
)


@pytest.mark.parametrize(
    ("value", "printed"),
    [
        ([0.0, -0.0, 1.0, 27501], b"[0,0,1,27501]"),
        ((0.41, 0.25), b"[0.41,0.25]"),
        ({"value": False}, b'{"value":false}'),
        ({"version": "4.20.9\n"}, b'{"version":"4.20.9\\n"}'),
        (0.1 + 0.2, b"0.3"),
        ([1e-15], b"[0]"),
        ([True, 0.0], b"[true,0]"),
    ],
)
def test_prints_whole_numbers_without_a_point(value, printed):
    assert to_json(value) == printed


@given(st.lists(st.floats(-1e6, 1e6)))
def test_prints_numbers_that_read_back(values):
    assert json.loads(to_json(values)) == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (b"", "empty"),
        (b"  \r\n", "empty"),
        (b"[0.1, 0", "not JSON"),
        (b"hello", "not JSON"),
        (b"[0.1,0,0] x", "not JSON"),
        (b"[NaN,0,0]", "NaN"),
        (b"[0,Infinity,0]", "Infinity"),
        (b"[0,0,-Infinity]", "Infinity"),
        (b"\xff\xfe[", "UTF-8"),
        (b"[" * 60_000, "nested"),
        (b"[" + b"9" * 5000 + b",0,0]", "not JSON"),
    ],
    ids=lambda value: repr(value[:12]),
)
def test_refuses_bodies_that_are_not_json(body, reason):
    with pytest.raises(BadRequest, match=reason):
        from_json(body)


@given(st.binary(max_size=200))
def test_any_body_is_read_or_refused(body):
    try:
        from_json(body)
    except BadRequest:
        pass


@pytest.mark.parametrize("value", ["1", True, None, [1], {}, math.inf, 10**400])
def test_refuses_what_is_no_finite_number(value):
    with pytest.raises(BadRequest):
        number(value, "a number")


@pytest.mark.parametrize("value", [[1, 2], [1, 2, 3, 4], "abc", {"0": 1}, [1, 2, None], 3])
def test_refuses_wrong_arrays_of_numbers(value):
    with pytest.raises(BadRequest):
        numbers(value, 3, "three numbers")


@pytest.mark.parametrize("value", [-1, 8, 0.5, "0", True])
def test_refuses_wrong_indices(value):
    with pytest.raises(BadRequest):
        index(value, 8, "an index")


def test_takes_what_is_right():
    assert numbers([1, 2.5, -3], 3, "three numbers") == (1.0, 2.5, -3.0)
    assert index(7.0, 8, "an index") == 7
    assert booleans([True, False], 2, "two booleans") == [True, False]
    assert member({"num": 3}, "num", "num") == 3
    assert text(" name ", "a name") == "name"


@pytest.mark.parametrize("value", [0, 1, "true", None])
def test_refuses_what_is_no_boolean(value):
    with pytest.raises(BadRequest):
        boolean(value, "a boolean")


@pytest.mark.parametrize("value", [[], "x", {"val": True}])
def test_refuses_a_missing_member(value):
    with pytest.raises(BadRequest):
        member(value, "num", "num")
