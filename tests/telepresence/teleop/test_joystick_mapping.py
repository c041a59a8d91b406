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
def mapping():
    made = JoystickMapping(LINEAR)
    made.update(axes(), UP, 0.0)
    return made


def test_full_deflection_with_the_drive_button(mapping):
    mapping.update(axes(1.0, -1.0, 1.0), DRIVE, 0.1)
    assert mapping.command(0.1) == pytest.approx((0.3, -0.3, 0.6))
    mapping.update(axes(1.0), FAST, 0.15)
    assert mapping.command(0.15) == pytest.approx((0.6, 0.0, 0.0))


def test_nothing_without_the_button(mapping):
    mapping.update(axes(1.0), UP, 0.1)
    assert mapping.command(0.1) is None


def test_one_moment_of_zeros_after_it_is_let_go(mapping):
    mapping.update(axes(1.0), DRIVE, 0.1)
    mapping.command(0.1)
    mapping.update(axes(1.0), UP, 0.2)
    assert mapping.command(0.2) == (0.0, 0.0, 0.0)
    assert mapping.command(0.5) is None


def test_dead_zone_starts_at_zero(mapping):
    mapping.update(axes(0.09, -0.09, 0.1), DRIVE, 0.1)
    assert mapping.command(0.1) == pytest.approx((0.0, 0.0, 0.0))
    mapping.update(axes(0.55), DRIVE, 0.15)
    assert mapping.command(0.15).vx == pytest.approx(0.15)


def test_silence_of_the_pad_stops(mapping):
    mapping.update(axes(1.0), DRIVE, 0.1)
    assert mapping.command(0.29).vx > 0.0
    assert mapping.command(0.31) == (0.0, 0.0, 0.0)


def test_a_pad_that_comes_back_with_the_button_down_must_let_go_first(mapping):
    mapping.update(axes(1.0), DRIVE, 1.0)  # silent for a second before
    assert mapping.command(1.0) is None
    mapping.update(axes(1.0), UP, 1.1)
    mapping.update(axes(1.0), DRIVE, 1.2)
    assert mapping.command(1.2).vx == pytest.approx(0.3)


def test_a_stick_that_does_not_tremble_is_not_held_by_a_hand(mapping):
    for i in range(1, 60):
        mapping.update(axes(0.7), DRIVE, 0.05 * i)
        given = mapping.command(0.05 * i)
        if not 1.9 < 0.05 * i < 2.2:
            assert (given is not None and given.vx > 0.0) is (0.05 * i < 2.0)
    mapping.update(axes(0.7), UP, 3.0)
    mapping.update(axes(0.71), DRIVE, 3.05)
    assert mapping.command(3.05).vx > 0.0


def test_a_lost_pad_stops(mapping):
    mapping.update(axes(1.0), DRIVE, 0.1)
    mapping.command(0.1)
    mapping.lose()
    assert mapping.command(0.11) == (0.0, 0.0, 0.0)


def test_a_small_pad_and_nonsense_do_no_harm():
    mapping = JoystickMapping(replace(LINEAR, axis_turn=40))
    mapping.update([], [], 0.0)
    mapping.update([math.nan, math.inf], DRIVE, 0.1)
    assert mapping.command(0.1) == (0.0, 0.0, 0.0)


def test_a_curve_makes_small_deflections_slower():
    mapping = JoystickMapping(replace(LINEAR, curve=2.0))
    mapping.update(axes(), UP, 0.0)
    mapping.update(axes(0.55), DRIVE, 0.1)
    assert mapping.command(0.1).vx == pytest.approx(0.3 * 0.25)


def test_the_cross_creeps_and_does_not_have_to_tremble():
    mapping = JoystickMapping(replace(LINEAR, axis_hat_x=4, axis_hat_y=5))
    mapping.update([*axes(), 0.0, 0.0], UP, 0.0)
    for step in range(60):
        mapping.update([*axes(), 1.0, 1.0], DRIVE, 0.1 * step)
    assert mapping.command(5.9) == pytest.approx((0.05, 0.05, 0.0))


def test_other_speeds():
    mapping = JoystickMapping(LINEAR)
    mapping.rescale(0.1, 0.2, 1.5)
    mapping.update(axes(), UP, 0.0)
    mapping.update(axes(1.0, 0.0, -1.0), FAST, 0.1)
    assert mapping.command(0.1) == pytest.approx((0.15, 0.0, -0.3))
