"""Pads by the kernel's codes (linux/input-event-codes.h); the tables are what the drivers of these pads report."""

import pytest

from telepresence.teleop.joystick_layouts import DIRECT, XBOX, layout_of

XPAD = ([0, 1, 2, 3, 4, 5, 16, 17], [0x130, 0x131, 0x133, 0x134, 0x136, 0x137, 0x13A, 0x13B, 0x13C, 0x13D, 0x13E])
RIGHT_STICK_ON_Z = ([0, 1, 2, 5, 16, 17], [0x130, 0x131, 0x132, 0x133, 0x134, 0x135, 0x136, 0x137])
NUMBERED = ([0, 1, 2, 5, 16, 17], list(range(0x120, 0x12C)))


def padded(codes, size):
    return codes + [0] * (size - len(codes))


def read(axes, buttons):
    return layout_of(padded(axes, 64), padded(buttons, 512))


def test_an_xbox_pad():
    assert read(*XPAD) == XBOX


def test_a_pad_with_its_right_stick_on_z():
    layout = read(*RIGHT_STICK_ON_Z)
    assert (layout.right_x, layout.right_y, layout.hat_x, layout.hat_y) == (2, 3, 4, 5)
    assert (layout.B, layout.LB, layout.RB) == (1, 6, 7)


def test_a_pad_without_a_cross():
    layout = read([0, 1, 3, 4], XPAD[1])
    assert (layout.right_x, layout.hat_x, layout.hat_y) == (2, -1, -1)


@pytest.mark.parametrize(("codes", "layout"), [(NUMBERED, DIRECT), (([], []), XBOX)])
def test_pads_that_tell_little(codes, layout):
    assert read(*codes) == layout


@pytest.mark.parametrize("layout", [XBOX, DIRECT, read(*XPAD), read(*RIGHT_STICK_ON_Z)])
def test_the_dead_mans_switch_is_lb_on_every_pad(layout):
    driving = layout.driving()
    assert (driving.button_drive, driving.button_turbo) == (layout.LB, layout.RB)
