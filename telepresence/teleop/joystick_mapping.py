"""Gamepad -> velocity. No ROS, no device, no clock: the time is an argument.

Left stick and cross drive, right stick turns; the drive button lets it drive while it is held, the turbo button held
with it drives faster. Which buttons these are on which pad: `telepresence.teleop.joystick_layouts`. Scales by default:
rto_teleop's joystick (dietriro/rto_core, gulbasozan/robotino-ros2).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from telepresence.geometry import ZERO_VELOCITY, Velocity
from telepresence.teleop.command_timeout import ZEROS_TIME

MAX_AGE = 0.2
"""Seconds after which a pad that has fallen silent counts as let go; it has to repeat its state meanwhile."""
PULLED = -0.2
"""A trigger is pulled from here on: 1 while it is let go, -1 at its end."""
STUCK_TIME = 2.0
"""Seconds after which a deflected stick that has not moved by one count asks for a new press of the drive button: a
hand trembles, a pad that has lost its radio does not."""


@dataclass(frozen=True)
class Layout:
    """Which axis and button does what, by number; joy_node's signs, left and up positive.

    Args:
        axis_x, axis_y, axis_turn: Forward, left, counter-clockwise.
        axis_hat_x, axis_hat_y: Cross of keys; -1: none. It creeps with `creep` [m/s].
        button_drive: The dead man's switch: nothing drives unless it is held.
        button_turbo: Held with it: faster.
        scale_linear, scale_angular: Speed at full deflection [m/s, rad/s].
        turbo: Factor while the turbo button is held too.
        dead_zone: Deflections below this are none; above it speed starts at zero.
        curve: Exponent of the deflection; above 1 small deflections drive slower.
        axis_nod: Up, of the stick that turns.
        axis_look, button_look: The trigger with which that stick turns the head instead, as an axis, 1 while it is let
            go, or as a button; -1: none.
    """

    axis_x: int
    axis_y: int
    axis_turn: int
    axis_hat_x: int
    axis_hat_y: int
    button_drive: int
    button_turbo: int
    scale_linear: float = 0.3
    scale_angular: float = 0.6
    turbo: float = 2.0
    dead_zone: float = 0.12
    curve: float = 1.7
    creep: float = 0.05
    axis_nod: int = -1
    axis_look: int = -1
    button_look: int = -1


class JoystickMapping:
    """The newest state of the pad, and what it asks for."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self.look: tuple[float, float] | None = None
        """How far the stick is tilted that turns the head, left and down, -1 to 1; None while its trigger is let go."""
        self._velocity = ZERO_VELOCITY
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
        if tuple(axes) != self._axes or self._velocity == ZERO_VELOCITY:
            self._axes, self._moved = tuple(axes), now
        elif now - self._moved > STUCK_TIME and pressed:
            self._armed = False
        self._held = pressed and self._armed
        factor = layout.turbo if _at(buttons, layout.button_turbo) else 1.0
        linear, angular = factor * layout.scale_linear, factor * layout.scale_angular
        looks = _at(axes, layout.axis_look) < PULLED or _at(buttons, layout.button_look) != 0
        self.look = None
        if looks:
            self.look = self._deflection(axes, layout.axis_turn), -self._deflection(axes, layout.axis_nod)
            angular = 0.0
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
        self._heard, self.look = -math.inf, None

    def command(self, now: float) -> Velocity | None:
        """What to send at `now` [s]; None for nothing, so that others may drive."""
        if self._held and now - self._heard <= MAX_AGE:
            self._zeros_until = now + ZEROS_TIME
            return self._velocity
        self._held = False
        return ZERO_VELOCITY if now <= self._zeros_until else None

    def _deflection(self, axes: Sequence[float], axis: int) -> float:
        value = _at(axes, axis)
        if not math.isfinite(value):
            return 0.0
        size = (min(1.0, abs(value)) - self._layout.dead_zone) / (1.0 - self._layout.dead_zone)
        return math.copysign(max(0.0, size) ** self._layout.curve, value)


def _at(values: Sequence[float], index: int) -> float:
    return values[index] if 0 <= index < len(values) else 0.0
