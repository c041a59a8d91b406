"""Driving by gamepad: hold LB and move. A pad that is unplugged, or a window that loses the keyboard, stops the robot.

The pad is read from Linux's joystick interface on Qt's thread; it tells only changes, so its state is taken anew every
50 ms. `receive` takes a pad from elsewhere in its place: the topic joy.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PyQt5.QtCore import QObject, QSocketNotifier, Qt, QTimer, pyqtSignal

from telepresence.teleop.joystick import Joystick
from telepresence.teleop.joystick_layouts import DEFAULT, XBOX, JoystickLayout, layout_of
from telepresence.teleop.joystick_mapping import JoystickMapping

log = logging.getLogger(__name__)

PERIOD = 50  # ms
LOOK_PERIOD = 1000  # ms between two looks for a pad that is not there
RESTART_HOLD = 1.0
"""Seconds that button 0 must be held: the thumb's first button is pressed by accident, too."""
FAST = 2.0
"""Factor of RB."""
SILENCE = 1.0
"""Seconds without word from a pad elsewhere after which it counts as gone."""


@dataclass(frozen=True)
class JoystickState:
    """A pad at one moment; axes -1 to 1, left and up positive, as in sensor_msgs/Joy.

    Args:
        driving: LB is held and lets it drive.
        restart: How far button 0 has been held towards a restart, 0 to 1.
        note: What to do next, for the pilot.
    """

    name: str
    layout: JoystickLayout
    axes: tuple[float, ...]
    buttons: tuple[int, ...]
    driving: bool
    restart: float
    note: str


class Gamepad(QObject):
    """A source of velocities.

    Args:
        path: The device; empty: the first joystick there is; None: no device, only `receive`.
    """

    velocity = pyqtSignal(float, float, float)
    """Forward, left [m/s], counter-clockwise [rad/s]; repeated while LB is held, then a few zeros."""
    blocked = pyqtSignal(str)
    """Somebody tried to drive while that is not possible; why."""
    stop_pressed = pyqtSignal()
    restart_wanted = pyqtSignal()
    """Button 0 was held for a second."""
    changed = pyqtSignal(object)
    """JoystickState, or None when there is no pad."""
    lost = pyqtSignal()
    """The pad is gone."""

    def __init__(self, path: str | None = "", parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.top_speed = 1.0
        """What RB can reach at most [m/s]."""
        self._path = path
        self._speed, self._turn = 0.2, 0.5
        self._device: Joystick | None = None
        self._notifier: QSocketNotifier | None = None
        self._name, self._layout = "", XBOX
        self._sticks = JoystickMapping(DEFAULT)
        self._axes: tuple[float, ...] = ()
        self._buttons: tuple[int, ...] = ()
        self._heard: float | None = None
        self._block = ""
        self._driving = False
        self._pressed_at: float | None = None
        self._state: JoystickState | None = None
        self._timer = QTimer(self, interval=PERIOD)
        self._timer.setTimerType(Qt.PreciseTimer)
        self._timer.timeout.connect(self._tick)
        self._search = QTimer(self, interval=LOOK_PERIOD)
        self._search.timeout.connect(self._poll)
        self._rescale()

    @property
    def speed(self) -> float:
        """At full deflection [m/s]."""
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed = value
        self._rescale()

    @property
    def turn(self) -> float:
        """At full deflection [rad/s]."""
        return self._turn

    @turn.setter
    def turn(self, value: float) -> None:
        self._turn = value
        self._rescale()

    @property
    def held(self) -> bool:
        """Whether it drives, be it with zero."""
        return self._driving

    @property
    def state(self) -> JoystickState | None:
        """What it looks like; None without a pad."""
        return self._state

    def start(self) -> None:
        """Look for the device from now on."""
        if self._path is not None:
            self._search.start()
            self._poll()

    def close(self) -> None:
        self._search.stop()
        self._lose()

    def receive(self, axes: Sequence[float], buttons: Sequence[int]) -> None:
        """The state of a pad that is elsewhere, in an Xbox pad's order; to be repeated ten times a second."""
        if self._heard is None:
            self._begin("joy", XBOX)
        self._heard = time.monotonic()
        self._axes, self._buttons = tuple(axes), tuple(buttons)
        self._tick()

    def release_all(self) -> None:
        """Do not drive until LB has been let go."""
        self._sticks.lose()
        self._tick()

    def set_block(self, reason: str) -> None:
        """Do not drive until the reason is an empty string again."""
        self._block = reason
        if reason:
            self.release_all()

    def _poll(self) -> None:
        paths = [Path(self._path)] if self._path else sorted(Path("/dev/input").glob("js*"))
        for path in paths:
            try:
                self._device = Joystick(str(path))
            except OSError as error:
                log.debug("no gamepad at %s: %s", path, error)
                continue
            self._search.stop()
            self._notifier = QSocketNotifier(self._device.fileno(), QSocketNotifier.Read, self)
            self._notifier.activated.connect(self._on_events)
            layout = layout_of(self._device.axis_codes, self._device.button_codes)
            self._begin(self._device.name or "Gamepad", layout)
            return

    def _begin(self, name: str, layout: JoystickLayout) -> None:
        log.info("gamepad: %s", name)
        self._name, self._layout = name, layout
        self._sticks = JoystickMapping(layout.sticks())
        self._rescale()
        self._axes, self._buttons = (), ()
        self._timer.start()
        self._tick()

    def _on_events(self) -> None:
        try:
            self._device.wait(0.0)
        except OSError as error:
            log.warning("%s", error)
            self._lose()
            self._search.start()
            return
        self._axes, self._buttons = tuple(self._device.axes), tuple(self._device.buttons)
        self._tick()

    def _lose(self) -> None:
        if not self._timer.isActive():
            return
        self._timer.stop()
        if self._device is not None:
            self._notifier.setEnabled(False)
            self._device.close()
            self._device = None
        self._heard = None
        self._sticks.lose()
        self._axes, self._buttons, self._pressed_at = (), (), None
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
        if self._heard is not None and now - self._heard > SILENCE:
            self._lose()
            return
        if self._heard is None or now - self._heard < PERIOD / 1000.0:
            self._sticks.update(self._axes, self._buttons, now)
        velocity = self._sticks.command(now)
        held = self._is_down(self._layout.LB)
        if self._block and held:
            self._sticks.lose()
            velocity = None
        driving = velocity is not None and held and self._sticks.armed
        if driving or self._driving:
            self._driving = driving
            self.velocity.emit(*(velocity or (0.0, 0.0, 0.0)))
        self._watch_buttons(now)
        self._show()

    def _watch_buttons(self, now: float) -> None:
        before = self._state.buttons if self._state is not None else self._buttons
        if self._is_down(self._layout.B) and not _at(before, self._layout.B):
            self.stop_pressed.emit()
        if self._block and self._is_down(self._layout.LB) and not _at(before, self._layout.LB):
            self.blocked.emit(self._block)
        if not self._is_down(0):
            self._pressed_at = None
        elif self._pressed_at is None:
            # Down since before we looked: that is not a press.
            self._pressed_at = now if not _at(before, 0) else float("inf")
        elif now - self._pressed_at >= RESTART_HOLD:
            self._pressed_at = float("inf")
            self.restart_wanted.emit()

    def _show(self) -> None:
        progress = 0.0
        if self._pressed_at is not None and self._pressed_at != float("inf"):
            progress = min(1.0, (time.monotonic() - self._pressed_at) / RESTART_HOLD)
        if self._driving:
            note = "Drives."
        elif self._block:
            note = self._block
        elif self._is_down(self._layout.LB):
            note = "Let go of LB, then hold it again to drive."
        else:
            note = "Hold LB and move to drive."
        state = JoystickState(self._name, self._layout, self._axes, self._buttons, self._driving, progress, note)
        if state != self._state:
            self._state = state
            self.changed.emit(state)

    def _is_down(self, button: int) -> bool:
        return bool(_at(self._buttons, button))

    def _rescale(self) -> None:
        turbo = max(1.0, min(FAST, self.top_speed / self._speed))
        self._sticks.rescale(self._speed, self._turn, turbo)


def _at(values: Sequence[int], index: int) -> int:
    return values[index] if 0 <= index < len(values) else 0
