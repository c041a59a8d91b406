"""A dead man's switch must be the same button everywhere, but in the node that is for the users of rto_core."""

import dataclasses
import inspect

from rto_teleop import joystick, rto_core_joystick

from gui.driving import gamepad
from telepresence.teleop.joystick_layouts import DEFAULT, DIRECT, XBOX, JoystickLayout
from telepresence.teleop.joystick_mapping import JoystickMapping, Layout


def test_window_and_gamepad_node_take_a_pad_for_the_same():
    assert gamepad.DEFAULT is DEFAULT
    assert inspect.signature(joystick.JoystickNode).parameters["layout"].default is JoystickLayout.driving
    assert (DEFAULT.button_drive, DEFAULT.button_turbo) == (XBOX.LB, XBOX.RB)


def test_every_part_of_the_mapping_is_a_parameter_that_the_node_documents():
    names = {field.name for field in dataclasses.fields(Layout)}
    assert {name for name in names if f"~{name}" in joystick.__doc__} == names
    others = {*rto_core_joystick.RTO_CORE_PARAMETERS} - names
    assert others and {name for name in others if f"~{name}" in rto_core_joystick.__doc__} == others
    assert {*rto_core_joystick.RTO_CORE_PARAMETERS.values()} == names


def test_for_the_users_of_rto_core_the_right_shoulder_button_drives_on_every_pad():
    for pad in (XBOX, DIRECT):
        layout = rto_core_joystick.rto_core_layout(pad)
        assert (layout.button_drive, layout.button_turbo) == (pad.RB, pad.LB)
        assert (layout.axis_x, layout.axis_y, layout.axis_turn) == (pad.left_y, pad.left_x, pad.right_x)


def test_an_axis_that_a_labs_launch_file_names_turns_both_ways():
    """rto_core's own file names axis 2, which is LT on an Xbox pad."""
    layout = dataclasses.replace(rto_core_joystick.rto_core_layout(XBOX), axis_turn=2)
    for stick in (1.0, -1.0):
        mapping = JoystickMapping(layout)
        mapping.update([0.0, 0.0, stick], [0] * 6, 0.0)
        mapping.update([0.0, 0.0, stick], [0, 0, 0, 0, 0, 1], 0.01)
        assert mapping.command(0.02) == (0.0, 0.0, stick * layout.scale_angular)
