"""Driving by gamepad: hold LB and move. The robot stops when the pad is unplugged or the window loses the keyboard.

The pad is read from Linux's joystick interface on Qt's thread. That reports only changes, so the state is evaluated
again every `SEND_PERIOD`. `receive` takes the state of a remote pad instead, from the topic joy.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PyQt5.QtCore import QObject, QSocketNotifier, pyqtSignal

from gui.periodic_timer import PeriodicTimer
from telepresence.teleop.command_timeout import SEND_PERIOD
from telepresence.teleop.hand_speeds import USUAL_SPEED, USUAL_TURN
from telepresence.teleop.joystick import Joystick
from telepresence.teleop.joystick_layouts import DEFAULT, XBOX, JoystickLayout, layout_of
from telepresence.teleop.joystick_mapping import JoystickMapping

log = logging.getLogger(__name__)

SEARCH_PERIOD = 1000  # ms between two attempts to find a pad
RESTART_HOLD = 1.0
"""[s] that button 0 must be held: it lies under the thumb and is pressed by accident, too."""
FAST = 2.0
"""Factor of the speed while RB is held."""
HALF_TILT = 0.5
"""Deflection of cross or left stick from which the robot walks without LB."""
ELSEWHERE = "Another window is in front, so the gamepad does not drive. Click this one."
SILENCE = 1.0
"""[s] without a message from a remote pad after which it counts as lost."""


@dataclass(frozen=True)
class JoystickState:
    """The state of a pad; axes from -1 to 1, left and up positive, as in sensor_msgs/Joy.

    Args:
        driving: Whether it drives: LB is held.
        restart: How far button 0 has been held towards a restart, 0 to 1.
        note: What to do next, for the pilot.
        direct: It drives without LB, see `Gamepad.direct`.
    """

    name: str
    layout: JoystickLayout
    axes: tuple[float, ...]
    buttons: tuple[int, ...]
    driving: bool
    restart: float
    note: str
    direct: bool = False


class Gamepad(QObject):
    """An input device: a gamepad.

    Args:
        path: The device; empty for the first joystick that is found; None for no device, only `receive`.
    """

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]; repeated while LB is held, then a few zeros."""
    looked = pyqtSignal(float, float)
    """The right stick is tilted with LT: left and down, -1 to 1; repeated, zeros once it is let go."""
    blocked = pyqtSignal(str)
    """Somebody tried to drive while it is blocked; the reason."""
    stop_pressed = pyqtSignal()
    restart_wanted = pyqtSignal()
    """Button 0 was held for a second, or pressed if the pad drives without LB."""
    changed = pyqtSignal(object)
    """JoystickState, or None when there is no pad."""
    lost = pyqtSignal()
    """The pad was unplugged or fell silent."""

    def __init__(self, path: str | None = "", parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.top_speed = 1.0
        """The highest speed with RB [m/s]."""
        self.direct = False
        """Cross and left stick walk forward and backward without LB, and button 0 restarts at once: for a simulated
        robot that can hurt nobody."""
        self._released = False
        """Cross and stick have been at rest since it was last forbidden to drive without LB."""
        self._path = path
        self._speed, self._turn = USUAL_SPEED, USUAL_TURN
        self._device: Joystick | None = None
        self._notifier: QSocketNotifier | None = None
        self._name, self._layout = "", XBOX
        self._mapping = JoystickMapping(DEFAULT)
        self._axes: tuple[float, ...] = ()
        self._buttons: tuple[int, ...] = ()
        self._pressed: list[int] = []
        """Buttons that have gone down since the last tick; some may be up again."""
        self._known = 0
        """So many buttons were known at the last tick."""
        self._received_at: float | None = None
        self._block, self._elsewhere = "", False
        self._driving = self._looks = False
        self._pressed_at: float | None = None
        self._state: JoystickState | None = None
        self._timer = PeriodicTimer(round(1000 * SEND_PERIOD), self._tick, self, precise=True)
        self._search = PeriodicTimer(SEARCH_PERIOD, self._poll, self)
        self._rescale()

    @property
    def speed(self) -> float:
        """Speed at full deflection [m/s]."""
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed = value
        self._rescale()

    @property
    def turn(self) -> float:
        """Rate of turn at full deflection [rad/s]."""
        return self._turn

    @turn.setter
    def turn(self, value: float) -> None:
        self._turn = value
        self._rescale()

    @property
    def keeps_control(self) -> bool:
        """Whether LB is held and lets it drive, even with the sticks at rest."""
        return self._driving

    @property
    def state(self) -> JoystickState | None:
        """The state of the pad; None without one."""
        return self._state

    def start(self) -> None:
        """Search for the device from now on."""
        if self._path is not None:
            self._search.start()
            self._poll()

    def close(self) -> None:
        self._search.stop()
        self._lose()

    def receive(self, axes: Sequence[float], buttons: Sequence[int]) -> None:
        """Take the state of a remote pad, in the order of an Xbox pad; to be repeated ten times a second."""
        if self._received_at is None:
            self._begin("joy", XBOX)
        self._received_at = time.monotonic()
        self._pressed = [n for n, was in enumerate(self._buttons) if not was and _at(buttons, n)]
        self._axes, self._buttons = tuple(axes), tuple(buttons)
        self._tick()

    def release_all(self) -> None:
        """Do not drive until LB has been released."""
        self._mapping.lose()
        self._released = False
        self._tick()

    def set_block(self, reason: str, passing: bool = False) -> None:
        """Do not drive until the reason is an empty string again, and then only when LB is pressed again."""
        self._block = reason
        if reason:
            self.release_all()

    def set_elsewhere(self, elsewhere: bool) -> None:
        """Do not drive while the pilot may be looking at another window, which the pad may be meant for, too."""
        if elsewhere and not self._elsewhere:
            self.release_all()
        self._elsewhere = elsewhere

    @property
    def _obstacle(self) -> str:
        """Why the pad does not drive; empty when it does."""
        # A robot that is driven without LB is simulated, and seen in a window of its own.
        return self._block or (ELSEWHERE if self._elsewhere and not self.direct else "")

    def _poll(self) -> None:
        paths = [Path(self._path)] if self._path else sorted(Path("/dev/input").glob("js*"))
        for path in paths:
            try:
                self._device = Joystick(str(path))
            except OSError as error:
                log.debug("no gamepad at %s: %s", path, error)
                continue
            self._search.stop()
            self._notifier = QSocketNotifier(self._device.fileno(), QSocketNotifier.Type.Read, self)  # type: ignore[arg-type]
            self._notifier.activated.connect(self._on_events)
            layout = layout_of(self._device.axis_codes, self._device.button_codes)
            self._begin(self._device.name or "Gamepad", layout)
            return

    def _begin(self, name: str, layout: JoystickLayout) -> None:
        log.info("Joystick detected: %s", name)
        self._name, self._layout = name, layout
        self._mapping = JoystickMapping(layout.driving())
        self._rescale()
        self._axes, self._buttons = (), ()
        self._pressed, self._known = [], 0
        self._released = False
        self._timer.start()
        self._tick()

    def _on_events(self) -> None:
        if self._device is None:
            return
        try:
            self._device.wait(0.0)
        except OSError as error:
            log.warning("%s", error)
            self._lose()
            self._search.start()
            return
        self._pressed = self._device.pressed
        self._axes, self._buttons = tuple(self._device.axes), tuple(self._device.buttons)
        self._tick()

    def _lose(self) -> None:
        if not self._timer.isActive():
            return
        self._timer.stop()
        if self._notifier is not None:
            self._notifier.setEnabled(False)
            self._notifier.deleteLater()
            self._notifier = None
        if self._device is not None:
            self._device.close()
            self._device = None
        self._received_at = None
        self._mapping.lose()
        self._axes, self._buttons, self._pressed_at = (), (), None
        self._watch_head()
        if self._driving:
            self._driving = False
            self.velocity.emit(0.0, 0.0, 0.0)
        self._state = None
        self.changed.emit(None)
        self.lost.emit()

    def _tick(self) -> None:
        now = time.monotonic()
        if not self._timer.isActive():
            return
        if self._received_at is not None and now - self._received_at > SILENCE:
            self._lose()
            return
        if self._received_at is None or now - self._received_at < SEND_PERIOD:
            self._mapping.update(self._axes, self._buttons, now)
        velocity, driving = self._direct_command() if self.direct else self._command(now)
        if driving or self._driving:
            self._driving = driving
            self.velocity.emit(*(velocity or (0.0, 0.0, 0.0)))
        self._watch_head()
        self._watch_buttons(now)
        self._show()

    def _command(self, now: float) -> tuple[tuple[float, float, float] | None, bool]:
        """Return what to send, and whether LB lets it drive."""
        velocity = self._mapping.command(now)
        held = self._is_down(self._layout.LB)
        if self._obstacle and held:
            self._mapping.lose()
            velocity = None
        return velocity, velocity is not None and held and self._mapping.armed

    def _direct_command(self) -> tuple[tuple[float, float, float] | None, bool]:
        """Return what to send, and whether cross or left stick are up or down."""
        tilts = (_at(self._axes, axis) for axis in (self._layout.hat_y, self._layout.left_y))
        up = next((math.copysign(1.0, tilt) for tilt in tilts if abs(tilt) > HALF_TILT), 0.0)
        if not up:
            self._released = True
        elif self._block:
            if self._released:
                self.blocked.emit(self._block)
            self._released = False
        driving = bool(up) and self._released
        return ((up * self._speed, 0.0, 0.0) if driving else None), driving

    def _watch_head(self) -> None:
        left, down = self._mapping.look or (0.0, 0.0)
        if left or down or self._looks:
            self._looks = bool(left or down)
            self.looked.emit(left, down)

    def _watch_buttons(self, now: float) -> None:
        # Noted before anything is emitted: a stop comes back here by `release_all`.
        pressed, self._pressed = self._pressed, []
        known, self._known = self._known, len(self._buttons)
        for number in pressed:
            log.info("Button %d pressed", number)
        # Nobody knows since when it is down on a pad that has just been found: a stop too many does no harm.
        if self._layout.B in pressed or (self._layout.B >= known and self._is_down(self._layout.B)):
            self.stop_pressed.emit()
        if self.direct:
            if 0 in pressed:
                self.restart_wanted.emit()
            return
        if self._obstacle and self._layout.LB in pressed:
            self.blocked.emit(self._obstacle)
        if not self._is_down(0) or self._elsewhere:
            self._pressed_at = None
        elif 0 in pressed:
            self._pressed_at = now
        elif self._pressed_at is None:
            # It was down when the pad was found: that is not a press.
            self._pressed_at = float("inf")
        elif now - self._pressed_at >= RESTART_HOLD:
            self._pressed_at = float("inf")
            self.restart_wanted.emit()

    def _show(self) -> None:
        progress = 0.0
        if self._pressed_at is not None and self._pressed_at != float("inf"):
            progress = min(1.0, (time.monotonic() - self._pressed_at) / RESTART_HOLD)
        if self._driving:
            note = "Drives."
        elif self._obstacle:
            note = self._obstacle
        elif self.direct:
            note = "Cross or left stick up and down walk; let go to stop. Button 0 restarts."
        elif self._is_down(self._layout.LB):
            note = "Let go of LB, then hold it again to drive."
        else:
            note = "Hold LB and move to drive."
        state = JoystickState(
            self._name, self._layout, self._axes, self._buttons, self._driving, progress, note, self.direct
        )
        if state != self._state:
            self._state = state
            self.changed.emit(state)

    def _is_down(self, button: int) -> bool:
        return bool(_at(self._buttons, button))

    def _rescale(self) -> None:
        turbo = max(1.0, min(FAST, self.top_speed / self._speed))
        self._mapping.rescale(self._speed, self._turn, turbo)


def _at(values: Sequence[float], index: int) -> float:
    return values[index] if 0 <= index < len(values) else 0
