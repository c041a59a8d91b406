"""Beside the pad: the speed limit, the red stop, and what the gamepad does."""

from __future__ import annotations

import math
import time
from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import QPushButton, QSlider, QWidget

from gui.driving.gamepad import JoystickState
from gui.styling import set_property
from gui.widgets.label import Label, caption
from telepresence.security.outside_text import clean
from telepresence.teleop.hand_speeds import SPEED_STEP, TURN_PER_SPEED, USUAL_SPEED

GUIDE_SPEED, GUIDE_TURN_PER_SPEED = 0.05, 1.0
"""[m/s], [rad/s per m/s] of the Robotino guide: 0.05 m/s and 0.05 rad/s."""
LONGEST = 16
"""Characters of a name on the red stop: a longer one would widen the window."""
PANIC_TIME = 1.0
"""[s] after a stop in which another press does not reset it: people in a panic press twice."""


class DriveControls(QWidget):
    """Slider, red stop, gamepad chip."""

    speeds_changed = pyqtSignal(float, float)
    """[m/s], [rad/s] that inputs may ask for."""
    stop_wanted = pyqtSignal()
    reset_wanted = pyqtSignal()
    """The red stop was clicked to reset it."""
    pad_wanted = pyqtSignal()
    """The gamepad's page should be shown."""
    restart_wanted = pyqtSignal()
    """The simulation should be restarted."""

    speedSlider: QSlider
    speedLabel: Label
    redStop: QPushButton
    padChip: QPushButton
    speedTitle: Label
    restartButton: QPushButton

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        uic.loadUi(str(Path(__file__).resolve().with_name("drive_controls.ui")), self)
        self._stopped_by: str | None = None
        self._stopped_at = 0.0
        self._press_stops = False
        self._top_turn = 1.0
        self._turn_per_speed = TURN_PER_SPEED
        self._own_speed = USUAL_SPEED
        self._guide = False
        self.restartButton.hide()
        self.restartButton.clicked.connect(self.restart_wanted)
        self.speedSlider.valueChanged.connect(self._show_speeds)
        self.redStop.pressed.connect(self._on_red_pressed)
        self.redStop.clicked.connect(self._on_red_clicked)
        self.padChip.clicked.connect(self.pad_wanted)
        self.show_stopped("")
        self.show_pad(None)

    @property
    def speed(self) -> float:
        """[m/s]"""
        return self.speedSlider.value() * SPEED_STEP

    @property
    def turn(self) -> float:
        """[rad/s]"""
        return min(self._top_turn, self.speed * self._turn_per_speed)

    def set_limits(self, top_speed: float, top_turn: float, speed: float = USUAL_SPEED) -> None:
        """Set the robot's limits [m/s, rad/s] and the speed to start with [m/s]."""
        self._top_turn = top_turn
        self.speedSlider.setMaximum(max(1, int(top_speed / SPEED_STEP + 1e-6)))
        self.set_speed(speed)
        self._show_speeds()

    def set_speed(self, speed: float) -> None:
        """Set the speed, as near to this as the robot and the slider allow [m/s]."""
        if math.isfinite(speed):
            self.speedSlider.setValue(round(speed / SPEED_STEP))

    def set_guide_speeds(self, wanted: bool) -> None:
        """Start from the Robotino guide's speeds, 0.05 m/s and 0.05 rad/s, or go back to the ones before."""
        if wanted == self._guide:
            return
        self._guide = wanted
        self._turn_per_speed = GUIDE_TURN_PER_SPEED if wanted else TURN_PER_SPEED
        if wanted:
            self._own_speed = self.speed
        self.set_speed(GUIDE_SPEED if wanted else self._own_speed)
        self._show_speeds()

    def offer_restart_only(self) -> None:
        """Offer a restart of the simulation, and no speeds: the robot walks at its own."""
        for widget in (self.speedTitle, self.speedSlider, self.speedLabel):
            widget.hide()
        self.restartButton.show()

    def step_speed(self, steps: int) -> None:
        """Move the slider by this many steps."""
        self.speedSlider.setValue(self.speedSlider.value() + steps)

    def show_stopped(self, who: str) -> None:
        """Show who has stopped the robot; empty when it is not stopped."""
        if who == self._stopped_by:
            return
        self._stopped_by, self._stopped_at = who, time.monotonic()
        who = clean(who, LONGEST)
        self.redStop.setText(caption(f"STOPPED by {who}\nPress to reset") if who else "STOP\nEsc")
        self.redStop.setAccessibleName(f"Red stop: STOPPED by {who}. Press to reset" if who else "Red stop")
        self.redStop.setToolTip("Resets the stop (Shift+Esc)" if who else "Stops the robot and keeps it stopped (Esc)")
        set_property(self.redStop, "stopped", bool(who))

    def show_pad(self, state: JoystickState | None) -> None:
        """Show what the gamepad does; None when there is none."""
        if state is None:
            self.padChip.setText("No gamepad")
        else:
            ready = "Gamepad ready" if state.direct else "Gamepad ready: hold LB"
            self.padChip.setText("Gamepad drives" if state.driving else ready)
        set_property(self.padChip, "on", state is not None and state.driving)

    def _on_red_pressed(self) -> None:
        """Stop at once, also when the hand slips off the button or keeps it down."""
        self._press_stops = not self._stopped_by
        if self._press_stops:
            self.stop_wanted.emit()

    def _on_red_clicked(self) -> None:
        if self._press_stops:
            return
        if not self._stopped_by:
            self.stop_wanted.emit()
        elif time.monotonic() - self._stopped_at > PANIC_TIME:
            self.reset_wanted.emit()

    def _show_speeds(self) -> None:
        self.speedLabel.setText(f"{self.speed:.2f} m/s")
        self.speeds_changed.emit(self.speed, self.turn)
