"""A dead man's switch must be the same button everywhere."""

import dataclasses

from rto_teleop import joystick

from gui.driving import gamepad
from telepresence.teleop.joystick_layouts import DEFAULT, XBOX
from telepresence.teleop.joystick_mapping import Layout


def test_window_and_gamepad_node_take_a_pad_for_the_same():
    assert joystick.DEFAULT is gamepad.DEFAULT is DEFAULT
    assert (DEFAULT.button_drive, DEFAULT.button_turbo) == (XBOX.LB, XBOX.RB)


def test_every_part_of_the_mapping_is_a_parameter_that_the_node_documents():
    names = {field.name for field in dataclasses.fields(Layout)}
    assert {name for name in names if f"~{name}" in joystick.__doc__} == names
