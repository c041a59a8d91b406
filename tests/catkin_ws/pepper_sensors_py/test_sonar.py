from __future__ import annotations

import math

import pytest
from pepper_sensors.sonar import to_range


@pytest.mark.parametrize(
    ("value", "expected"), [(1.5, 1.5), (2.55, 2.55), (2.56, math.inf), (5.0, math.inf), (0.25, 0.25), (0.1, -math.inf)]
)
def test_ranges_follow_rep_117(value, expected):
    assert to_range(value) == expected


@pytest.mark.parametrize("value", [None, math.nan, "far"])
def test_a_missing_sensor_is_no_free_space(value):
    assert math.isnan(to_range(value))
