"""The axes and buttons of gamepads, by the kernel's own names where it has any.

Sources: Linux, Documentation/input/gamepad.rst and include/uapi/linux/input-event-codes.h; Logitech F710 with its
switch on D: ROS wiki, joy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from telepresence.teleop.joystick_mapping import Layout

_AXES = {
    "left_x": (0x00,),  # ABS_X
    "left_y": (0x01,),  # ABS_Y
    "right_x": (0x03, 0x02),  # ABS_RX, else ABS_Z
    "right_y": (0x04, 0x05),  # ABS_RY, else ABS_RZ
    "hat_x": (0x10,),  # ABS_HAT0X
    "hat_y": (0x11,),  # ABS_HAT0Y
    "trigger": (0x02,),  # ABS_Z
}
_BUTTONS = {
    "B": 0x131,  # BTN_EAST
    "LB": 0x136,  # BTN_TL
    "RB": 0x137,  # BTN_TR
    "LT": 0x138,  # BTN_TL2
}
_SOUTH = 0x130


@dataclass(frozen=True)
class JoystickLayout:
    """Numbers of axes and buttons; -1 where the pad has none. `trigger` is LT as an axis, 1 while it is let go."""

    left_x: int
    left_y: int
    right_x: int
    right_y: int
    hat_x: int
    hat_y: int
    B: int
    LB: int
    RB: int
    trigger: int = -1
    LT: int = -1

    def driving(self) -> Layout:
        """Return what the pad's axes and buttons do: hold LB to drive with left stick and cross, turn with the right
        stick; RB is fast."""
        return Layout(
            axis_x=self.left_y,
            axis_y=self.left_x,
            axis_turn=self.right_x,
            axis_hat_x=self.hat_x,
            axis_hat_y=self.hat_y,
            button_drive=self.LB,
            button_turbo=self.RB,
            axis_nod=self.right_y,
            axis_look=self.trigger,
            button_look=self.LT,
        )


XBOX = JoystickLayout(left_x=0, left_y=1, right_x=3, right_y=4, hat_x=6, hat_y=7, B=1, LB=4, RB=5, trigger=2)
"""Xbox (xpad), DualShock 4, Logitech F710 with its switch on X: where the kernel has no names."""
DEFAULT = XBOX.driving()
"""What the window and the gamepad node take a pad for, unless the kernel or a parameter knows better."""
DIRECT = JoystickLayout(left_x=0, left_y=1, right_x=2, right_y=3, hat_x=4, hat_y=5, B=2, LB=4, RB=5, LT=6)
"""Logitech F710 with its switch on D, and other pads whose buttons have only numbers."""


def layout_of(axis_codes: Sequence[int], button_codes: Sequence[int]) -> JoystickLayout:
    """The layout that belongs to the kernel's codes, see `telepresence.teleop.joystick.Joystick`."""
    if not any(button_codes):
        return XBOX
    if _SOUTH not in button_codes:
        return DIRECT
    axes = {name: _first(axis_codes, codes) for name, codes in _AXES.items()}
    if axes["trigger"] == axes["right_x"]:
        axes["trigger"] = -1
    return JoystickLayout(**axes, **{name: _first(button_codes, (code,)) for name, code in _BUTTONS.items()})


def _first(codes: Sequence[int], wanted: Sequence[int]) -> int:
    known = list(codes[: _count(codes)])
    return next((known.index(code) for code in wanted if code in known), -1)


def _count(codes: Sequence[int]) -> int:
    """How many of the codes mean something: behind the pad's own are zeros. ABS_X is zero, too, and comes first."""
    return max((index for index, code in enumerate(codes) if code), default=0) + 1
