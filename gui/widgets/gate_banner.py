"""Shows what the safety gate does, in one word and one sentence, or what has failed; switches the careful scan."""

from __future__ import annotations

import time

from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import QCheckBox, QFrame, QGridLayout, QSizePolicy, QWidget

from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import Careful, Safety
from gui.styling import restyle, set_property
from gui.widgets.label import Label, tip
from telepresence.security.outside_text import clean

SILENT_AFTER = 1.0
"""[s] without a message after which the safety gate counts as silent."""
LEVELS = {
    "clear": "good", "no command": "off", "limited": "warn", "blocked": "bad", "bumped": "bad", "stopped": "bad",
    "sensor stale": "bad", "fault": "bad",
}  # fmt: skip
"""State (telepresence_msgs/SafetyState) -> level of the style sheet."""
CAREFUL = "Careful scan: sway while driving, to see between the sensors"
CAREFUL_TIP = (
    "While the robot drives, its body turns 22° to and fro: nine beams then see all around. "
    "The picture sways; the robot goes where you steer."
)
WATCHES = "Only whoever drives switches this."
WORDS = {
    "clear": "Way is free", "no command": "Ready", "limited": "Slowed", "blocked": "Blocked", "bumped": "Bumped",
    "stopped": "Stopped", "sensor stale": "Sensor lost", "fault": "Fault",
}  # fmt: skip

LONGEST = 20
"""Characters of a word that is none of these: a longer one would widen the window."""


class GateBanner(QFrame):
    """Shows state and reason, or that the safety gate is silent; instead of them a fault, for as long as there is one.

    Attributes:
        careful_choice: Whether the pilot wants the careful scan; None before a first choice. A gate for which nobody
            has chosen is switched to it.
    """

    careful_wanted = pyqtSignal(bool)
    """The careful scan is to be switched on, or off."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._arrived = 0.0
        self._fault = self._own = ("", "", "off")
        self.careful_choice: bool | None = None
        self._careful: Careful | None = None
        self._may_switch = False
        layout = QGridLayout(self)
        layout.setContentsMargins(10, 6, 10, 6)
        layout.setHorizontalSpacing(10)
        layout.setVerticalSpacing(4)
        self._word = Label()
        self._word.setProperty("role", "word")
        self._reason = Label()
        self._reason.setProperty("role", "reason")
        self._reason.setWordWrap(True)
        self._reason.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._switch = QCheckBox(CAREFUL)
        self._switch.setObjectName("carefulSwitch")
        self._switch.clicked.connect(self._on_switch)
        self._switch.hide()
        layout.addWidget(self._word, 0, 0)
        layout.addWidget(self._reason, 0, 1)
        layout.addWidget(self._switch, 1, 0, 1, 2)
        layout.setColumnStretch(1, 1)
        self._check = PeriodicTimer(250, self._poll, self)
        self._check.start()
        self.clear()

    @property
    def text(self) -> str:
        """The word and the reason that are shown."""
        return f"{self._word.text()}: {self._reason.text()}"

    @property
    def level(self) -> str:
        """off, good, warn or bad."""
        return self.property("level")

    def show_reading(self, reading: object) -> None:
        """Show a `Safety` or the state of the careful scan; other readings are ignored."""
        if isinstance(reading, Careful):
            self._careful = reading
            self._show_careful()
        elif isinstance(reading, Safety):
            self._arrived = reading.arrived
            self._show(reading.state, reading.reason)

    def set_may_switch(self, may: bool) -> None:
        """Let the careful scan be switched here, or only be seen."""
        self._may_switch = may
        self._show_careful()

    def _show_careful(self) -> None:
        state = self._careful
        self._switch.setVisible(state is not None)
        if state is None:
            return
        self._switch.setChecked(state.on)
        self._switch.setEnabled(self._may_switch and not state.unavailable)
        self._switch.setToolTip(tip(state.unavailable or (CAREFUL_TIP if self._may_switch else WATCHES)))
        if state.by_default and self._may_switch and self.careful_choice not in (None, state.on):
            self.careful_wanted.emit(bool(self.careful_choice))

    def _on_switch(self, wanted: bool) -> None:
        """Ask for it; the box shows what the gate reports, not what was asked for."""
        self.careful_choice = wanted
        self._switch.setChecked(self._careful is not None and self._careful.on)
        self.careful_wanted.emit(wanted)

    def clear(self) -> None:
        self._arrived = 0.0
        self._careful = None
        self._show_careful()
        self._say("No gate", "No safety gate is running. It starts with the robot's programs.", "off")

    def _poll(self) -> None:
        if self._arrived and time.monotonic() - self._arrived > SILENT_AFTER:
            self._arrived = 0.0
            self._say("Silent", "The safety gate fell silent. Expect no protection until it is back.", "bad")

    def _show(self, state: str, reason: str) -> None:
        self._say(WORDS.get(state, clean(state.capitalize(), LONGEST)), reason, LEVELS.get(state, "off"))

    def show_fault(self, word: str, sentence: str, level: str) -> None:
        """Show what has failed in place of what the gate does, until the sentence is empty again."""
        self._fault = (word, sentence, level)
        self._update()

    def _say(self, word: str, reason: str, level: str) -> None:
        self._own = (word, reason[:1].upper() + reason[1:], level)
        self._update()

    def _update(self) -> None:
        word, reason, level = self._fault if self._fault[1] else self._own
        self._word.setText(word)
        if self._reason.text() != reason:
            self._reason.setText(reason)
            self._reason.setToolTip(reason)
        if self.property("level") != level:
            set_property(self, "level", level)
            restyle(self._word)  # the sheet colours them by the level of the frame around them
            restyle(self._reason)
