from __future__ import annotations

import math

import pytest
from naoqi_pose.trajectory import UnusableTrajectory, to_interpolation


def no_groups(name: str) -> list[str]:
    raise AssertionError(f"{name} is no group")


def test_points_become_a_list_of_values_for_every_joint():
    result = to_interpolation(["HeadYaw", "HeadPitch"], [(1.0, [0.1, 0.2]), (2.5, [0.3, 0.4])], no_groups)
    assert result.names == ["HeadYaw", "HeadPitch"]
    assert result.values == [[0.1, 0.3], [0.2, 0.4]]
    assert result.times == [[1.0, 2.5], [1.0, 2.5]]
    assert result.duration == 2.5


def test_a_group_stands_for_its_joints():
    result = to_interpolation(["Head"], [(1.0, [0.1, 0.2])], lambda name: ["HeadYaw", "HeadPitch"])
    assert result.names == ["HeadYaw", "HeadPitch"]


def test_one_value_goes_to_every_joint():
    result = to_interpolation(["LHand", "RHand"], [(1.0, [0.5])], no_groups)
    assert result.values == [[0.5], [0.5]]


@pytest.mark.parametrize(
    ("names", "points", "complaint"),
    [
        ([], [(1.0, [0.1])], "needs joints"),
        (["HeadYaw"], [], "needs joints and points"),
        (["HeadYaw"], [(1.0, [0.1]), (2.0, [0.1, 0.2])], "point 2 has 2 values, the first has 1"),
        (["HeadYaw"], [(1.0, [math.nan])], "point 1 holds a value that is not finite"),
        (["HeadYaw"], [(0.0, [0.1])], "point 1 is due 0 s"),
        (["HeadYaw"], [(2.0, [0.1]), (1.0, [0.1])], "point 2 is due 1 s from the start, which is not after 2 s"),
    ],
)
def test_contradictions_are_named(names, points, complaint):
    with pytest.raises(UnusableTrajectory, match=complaint):
        to_interpolation(names, points, no_groups)


def test_wrong_number_of_values_names_the_joints():
    with pytest.raises(UnusableTrajectory, match="3 values for 2 joints: HeadYaw, HeadPitch"):
        to_interpolation(["HeadYaw", "HeadPitch"], [(1.0, [1, 2, 3])], lambda name: [name])
