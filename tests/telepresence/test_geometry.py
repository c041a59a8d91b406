import math
from itertools import product

import numpy as np
import pytest

from telepresence.geometry import Pose, Velocity, require_finite, roll_pitch_yaw, wrap_angle, yaw_of

ANGLES = (-3.0, -1.2, -0.3, 0.0, 0.4, 1.1, 2.9)


def _about(axis, angle):
    """The quaternion (w, x, y, z) of a rotation about axis 0, 1 or 2."""
    quaternion = [math.cos(angle / 2), 0.0, 0.0, 0.0]
    quaternion[1 + axis] = math.sin(angle / 2)
    return quaternion


def _product(a, b):
    aw, av, bw, bv = a[0], np.array(a[1:]), b[0], np.array(b[1:])
    return [aw * bw - av @ bv, *(aw * bv + bw * av + np.cross(av, bv))]


def test_velocity_and_pose_are_plain_tuples_with_names():
    vx, vy, wz = Velocity(0.3, -0.1, 0.5)
    assert (vx, vy, wz) == Velocity(vx=0.3, vy=-0.1, wz=0.5)
    assert Pose(1.0, 2.0, 0.5).theta == 0.5


def test_what_is_not_finite_is_named():
    require_finite("velocity", (1.0, -2, 0.0))
    for bad in (math.nan, math.inf, -math.inf):
        with pytest.raises(ValueError, match=rf"a velocity must be finite numbers, got \(1.0, {bad}\)"):
            require_finite("velocity", iter((1.0, bad)))


@pytest.mark.parametrize(("roll", "pitch", "yaw"), product(ANGLES, (-1.5, -0.4, 0.0, 0.8, 1.5), ANGLES))
def test_rotations_about_fixed_axes_are_found_again(roll, pitch, yaw):
    quaternion = _product(_about(2, yaw), _product(_about(1, pitch), _about(0, roll)))
    for sign in (1.0, -1.0):  # a quaternion and its negative are the same rotation
        found = roll_pitch_yaw(*(sign * value for value in quaternion))
        assert found == pytest.approx((roll, pitch, yaw), abs=1e-7)
        assert yaw_of(*(sign * value for value in quaternion)) == found.yaw


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_body_that_looks_straight_down_or_up_has_a_pitch_of_a_quarter_turn(sign):
    half = math.nextafter(math.sqrt(0.5), 1.0)  # the sine of the pitch comes out above one
    assert roll_pitch_yaw(half, 0.0, sign * half, 0.0).pitch == pytest.approx(sign * math.pi / 2)


@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3 * math.pi, math.pi),
        (-3 * math.pi, math.pi),
        (math.pi + 0.1, 0.1 - math.pi),
        (-math.pi - 0.1, math.pi - 0.1),
        (20 * math.tau + 0.5, 0.5),
    ],
)
def test_angles_are_wrapped_to_half_a_turn_either_way(angle, wrapped):
    assert wrap_angle(angle) == pytest.approx(wrapped)
    assert -math.pi < wrap_angle(angle) <= math.pi


def test_an_infinite_angle_has_no_direction():
    with pytest.raises(ValueError):
        wrap_angle(math.inf)
