import math
from dataclasses import replace

import pytest

from telepresence.teleop.joystick_layouts import DEFAULT
from telepresence.teleop.joystick_mapping import JoystickMapping

UP = [0] * 8
DRIVE = [0, 0, 0, 0, 1, 0, 0, 0]
FAST = [0, 0, 0, 0, 1, 1, 0, 0]
LINEAR = replace(DEFAULT, dead_zone=0.1, curve=1.0)


def axes(x=0.0, y=0.0, turn=0.0):
    return [y, x, 0.0, turn]


@pytest.fixture
def sticks():
    made = JoystickMapping(LINEAR)
    made.update(axes(), UP, 0.0)
    return made


def test_full_deflection_with_the_drive_button(sticks):
    sticks.update(axes(1.0, -1.0, 1.0), DRIVE, 0.1)
    assert sticks.command(0.1) == pytest.approx((0.3, -0.3, 0.6))
    sticks.update(axes(1.0), FAST, 0.15)
    assert sticks.command(0.15) == pytest.approx((0.6, 0.0, 0.0))


def test_nothing_without_the_button(sticks):
    sticks.update(axes(1.0), UP, 0.1)
    assert sticks.command(0.1) is None


def test_one_moment_of_zeros_after_it_is_let_go(sticks):
    sticks.update(axes(1.0), DRIVE, 0.1)
    sticks.command(0.1)
    sticks.update(axes(1.0), UP, 0.2)
    assert sticks.command(0.2) == (0.0, 0.0, 0.0)
    assert sticks.command(0.5) is None


def test_dead_zone_starts_at_zero(sticks):
    sticks.update(axes(0.09, -0.09, 0.1), DRIVE, 0.1)
    assert sticks.command(0.1) == pytest.approx((0.0, 0.0, 0.0))
    sticks.update(axes(0.55), DRIVE, 0.15)
    assert sticks.command(0.15).vx == pytest.approx(0.15)


def test_silence_of_the_pad_stops(sticks):
    sticks.update(axes(1.0), DRIVE, 0.1)
    assert sticks.command(0.29).vx > 0.0
    assert sticks.command(0.31) == (0.0, 0.0, 0.0)


def test_a_pad_that_comes_back_with_the_button_down_must_let_go_first(sticks):
    sticks.update(axes(1.0), DRIVE, 1.0)  # silent for a second before
    assert sticks.command(1.0) is None
    sticks.update(axes(1.0), UP, 1.1)
    sticks.update(axes(1.0), DRIVE, 1.2)
    assert sticks.command(1.2).vx == pytest.approx(0.3)


def test_a_stick_that_does_not_tremble_is_not_held_by_a_hand(sticks):
    for i in range(1, 60):
        sticks.update(axes(0.7), DRIVE, 0.05 * i)
        given = sticks.command(0.05 * i)
        if not 1.9 < 0.05 * i < 2.2:
            assert (given is not None and given.vx > 0.0) is (0.05 * i < 2.0)
    sticks.update(axes(0.7), UP, 3.0)
    sticks.update(axes(0.71), DRIVE, 3.05)
    assert sticks.command(3.05).vx > 0.0


def test_a_lost_pad_stops(sticks):
    sticks.update(axes(1.0), DRIVE, 0.1)
    sticks.command(0.1)
    sticks.lose()
    assert sticks.command(0.11) == (0.0, 0.0, 0.0)


def test_a_small_pad_and_nonsense_do_no_harm():
    sticks = JoystickMapping(replace(LINEAR, axis_turn=40))
    sticks.update([], [], 0.0)
    sticks.update([math.nan, math.inf], DRIVE, 0.1)
    assert sticks.command(0.1) == (0.0, 0.0, 0.0)


def test_a_curve_makes_small_deflections_slower():
    sticks = JoystickMapping(replace(LINEAR, curve=2.0))
    sticks.update(axes(), UP, 0.0)
    sticks.update(axes(0.55), DRIVE, 0.1)
    assert sticks.command(0.1).vx == pytest.approx(0.3 * 0.25)


def test_the_cross_creeps_and_does_not_have_to_tremble():
    sticks = JoystickMapping(replace(LINEAR, axis_hat_x=4, axis_hat_y=5))
    sticks.update([*axes(), 0.0, 0.0], UP, 0.0)
    for step in range(60):
        sticks.update([*axes(), 1.0, 1.0], DRIVE, 0.1 * step)
    assert sticks.command(5.9) == pytest.approx((0.05, 0.05, 0.0))


def test_other_speeds():
    sticks = JoystickMapping(LINEAR)
    sticks.rescale(0.1, 0.2, 1.5)
    sticks.update(axes(), UP, 0.0)
    sticks.update(axes(1.0, 0.0, -1.0), FAST, 0.1)
    assert sticks.command(0.1) == pytest.approx((0.15, 0.0, -0.3))
