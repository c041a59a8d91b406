import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotino_sim.json_body import to_json


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
