"""Gamepad driving for whoever is used to rto_core: RB lets it drive, LB makes it fast, the other way round than in the
window and in `rto_teleop.joystick`, of which this is otherwise the same node.

Parameters: ~axis_linear_x, ~axis_linear_y, ~axis_angular, ~deadzone, ~scale_turbo: that project's names; all others are
            those of `rto_teleop.joystick`.
Source: rto_teleop of dietriro/rto_core, joystick_teleop_node: names, buttons, dead zone, scales; a velocity in
proportion to the stick. That node needs joy_node, and repeats its last velocity for ever; this one reads the gamepad.
"""

from __future__ import annotations

import dataclasses

from rto_teleop.joystick import PARAMETERS, JoystickNode
from telepresence.teleop.joystick_layouts import JoystickLayout
from telepresence.teleop.joystick_mapping import Layout

RTO_CORE_PARAMETERS = PARAMETERS | {
    "axis_linear_x": "axis_x",
    "axis_linear_y": "axis_y",
    "axis_angular": "axis_turn",
    "deadzone": "dead_zone",
    "scale_turbo": "turbo",
}
"""Private parameter -> what it sets in a `Layout`."""


def rto_core_layout(pad: JoystickLayout) -> Layout:
    """Return what a pad's axes and buttons do there. Which axis turns is found by the kernel's name for it: that
    project's number, 2, is a trigger on an Xbox pad, and one that is let go would turn the robot."""
    buttons = {"button_drive": pad.RB, "button_turbo": pad.LB}
    # There is no head to turn: a launch file that names a trigger's axis for turning must get what it says.
    return dataclasses.replace(pad.driving(), **buttons, dead_zone=0.1, curve=1.0, axis_look=-1, button_look=-1)


def main() -> int:
    """Run the node; the exit code."""
    return JoystickNode("joystick_teleop_node", RTO_CORE_PARAMETERS, rto_core_layout).run()
