"""The figures are calculated by hand from the vendor's equations: wheel 60 mm, lever 175 mm, gear 32."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotino_sim.kinematics import RPM_PER_SPEED, body_velocity, motor_speeds

speeds = st.floats(-3.0, 3.0)


@pytest.mark.parametrize(
    ("velocity", "motors"),
    [
        ((0.2, 0.0, 0.0), (-882.1, 0.0, 882.1)),
        ((0.0, 0.2, 0.0), (509.3, -1018.6, 509.3)),
        ((0.0, 0.0, 1.0), (891.3, 891.3, 891.3)),
    ],
)
def test_motor_speeds_of_the_vendors_equations(velocity, motors):
    assert motor_speeds(*velocity) == pytest.approx(motors, abs=0.05)


def test_one_metre_per_second_at_the_rim():
    assert pytest.approx(5092.96, abs=0.01) == RPM_PER_SPEED


@given(speeds, speeds, speeds)
def test_body_velocity_undoes_motor_speeds(vx, vy, wz):
    assert body_velocity(motor_speeds(vx, vy, wz)) == pytest.approx((vx, vy, wz), abs=1e-9)


@pytest.mark.parametrize(
    ("axis", "greatest"), [((1.0, 0.0, 0.0), 0.680), ((0.0, 1.0, 0.0), 0.589), ((0.0, 0.0, 1.0), 3.37)]
)
def test_top_speed_at_3000_rpm(axis, greatest):
    fastest = max(map(abs, motor_speeds(*axis)))
    assert 3000.0 / fastest == pytest.approx(greatest, rel=0.002)


def test_equal_motors_only_turn():
    vx, vy, wz = body_velocity((500.0, 500.0, 500.0))
    assert (vx, vy) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert wz == pytest.approx(500.0 / RPM_PER_SPEED / 0.175)
    assert math.copysign(1.0, wz) == 1.0
