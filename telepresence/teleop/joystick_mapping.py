"""Gamepad -> velocity. No ROS, no device, no clock: the time is an argument.

Axes, buttons and scales by default: rto_teleop's joystick (dietriro/rto_core, gulbasozan/robotino-ros2), on an Xbox
pad: left stick drives, right stick turns, RB held lets it drive, LB held with it drives twice as fast.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

MAX_AGE = 0.2
"""Seconds after which a pad that has fallen silent counts as let go; it has to repeat its state meanwhile."""
STUCK_TIME = 2.0
"""Seconds after which a deflected stick that has not moved by one count asks for a new press of the drive button: a
hand trembles, a pad that has lost its radio does not."""
ZEROS_TIME = 0.3
"""Seconds for which zeros are sent after the pad was let go."""


class Velocity(NamedTuple):
    """Of base_link: forward and left [m/s], counter-clockwise [rad/s]."""

    vx: float
    vy: float
    wz: float


ZERO = Velocity(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Layout:
    """Which axis and button does what; joy_node's signs, left and up positive.

    Args:
        scale_linear, scale_angular: Speed at full deflection [m/s, rad/s].
        turbo: Factor while the turbo button is held too.
        dead_zone: Deflections below this are none; above it speed starts at zero.
        curve: Exponent of the deflection; above 1 small deflections drive slower.
        axis_hat_x, axis_hat_y: Cross of keys, left and up positive; -1: none. It creeps with `creep` [m/s].
    """

    axis_x: int = 1
    axis_y: int = 0
    axis_turn: int = 3
    button_drive: int = 5
    button_turbo: int = 4
    scale_linear: float = 0.3
    scale_angular: float = 0.6
    turbo: float = 2.0
    dead_zone: float = 0.1
    curve: float = 1.0
    axis_hat_x: int = -1
    axis_hat_y: int = -1
    creep: float = 0.05


class JoystickMapping:
    """The newest state of the pad, and what it asks for."""

    def __init__(self, layout: Layout | None = None) -> None:
        self._layout = layout or Layout()
        self._velocity = ZERO
        self._held = False
        self._armed = False  # the drive button was seen up since the pad appeared
        self._heard = -math.inf
        self._zeros_until = -math.inf
        self._axes: tuple[float, ...] = ()
        self._moved = -math.inf

    def update(self, axes: Sequence[float], buttons: Sequence[int], now: float) -> None:
        """The pad's state at `now` [s]. Axes and buttons that it does not have count as let go."""
        layout = self._layout
        if now - self._heard > MAX_AGE:
            self._armed = False
        self._heard = now
        pressed = _at(buttons, layout.button_drive) != 0
        self._armed = self._armed or not pressed
        if tuple(axes) != self._axes or self._velocity == ZERO:
            self._axes, self._moved = tuple(axes), now
        elif now - self._moved > STUCK_TIME and pressed:
            self._armed = False
        self._held = pressed and self._armed
        factor = layout.turbo if _at(buttons, layout.button_turbo) else 1.0
        linear, angular = factor * layout.scale_linear, factor * layout.scale_angular
        self._velocity = Velocity(
            linear * self._deflection(axes, layout.axis_x),
            linear * self._deflection(axes, layout.axis_y),
            angular * self._deflection(axes, layout.axis_turn),
        )
        hat = _at(axes, layout.axis_hat_y), _at(axes, layout.axis_hat_x)
        if any(hat) and not any(self._velocity):
            # Keys don't tremble: what says that a stick is stuck says nothing here.
            self._velocity, self._moved = Velocity(layout.creep * hat[0], layout.creep * hat[1], 0.0), now

    def rescale(self, linear: float, angular: float, turbo: float) -> None:
        """Other speeds from now on: at full deflection [m/s, rad/s], and the factor of the turbo button."""
        self._layout = replace(self._layout, scale_linear=linear, scale_angular=angular, turbo=turbo)

    @property
    def armed(self) -> bool:
        """Whether pressing the drive button would let it drive: it has to be seen up first."""
        return self._armed

    def lose(self) -> None:
        """The pad is gone, or must not drive until its drive button has been let go."""
        self._held = self._armed = False
        self._heard = -math.inf

    def command(self, now: float) -> Velocity | None:
        """What to send at `now` [s]; None for nothing, so that others may drive."""
        if self._held and now - self._heard <= MAX_AGE:
            self._zeros_until = now + ZEROS_TIME
            return self._velocity
        self._held = False
        return ZERO if now <= self._zeros_until else None

    def _deflection(self, axes: Sequence[float], axis: int) -> float:
        value = _at(axes, axis)
        if not math.isfinite(value):
            return 0.0
        size = (min(1.0, abs(value)) - self._layout.dead_zone) / (1.0 - self._layout.dead_zone)
        return math.copysign(max(0.0, size) ** self._layout.curve, value)


def _at(values: Sequence[float], index: int) -> float:
    return values[index] if 0 <= index < len(values) else 0.0
