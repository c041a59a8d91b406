"""Shows what the safety gate does, in one word and one sentence."""

from __future__ import annotations

import time

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QFrame, QHBoxLayout, QLabel, QSizePolicy, QWidget

from gui.periodic_timer import PeriodicTimer
from gui.ros.readings import Safety
from gui.styling import restyle, set_property

SILENT_AFTER = 1.0
"""[s] without a message after which the safety gate counts as silent."""
LEVELS = {
    "clear": "good", "no command": "off", "limited": "warn", "blocked": "bad", "bumped": "bad", "stopped": "bad",
    "sensor stale": "bad", "fault": "bad",
}  # fmt: skip
"""State (telepresence_msgs/SafetyState) -> level of the style sheet."""
WORDS = {
    "clear": "Way is free", "no command": "Ready", "limited": "Slowed", "blocked": "Blocked", "bumped": "Bumped",
    "stopped": "Stopped", "sensor stale": "Sensor lost", "fault": "Fault",
}  # fmt: skip


class GateBanner(QFrame):
    """Shows state and reason, or that the safety gate is silent."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._arrived = 0.0
        layout = QHBoxLayout(self)
        layout.setContentsMargins(10, 6, 10, 6)
        layout.setSpacing(10)
        self._word = QLabel()
        self._word.setProperty("role", "word")
        self._reason = QLabel()
        self._reason.setProperty("role", "reason")
        self._reason.setWordWrap(True)
        self._reason.setTextFormat(Qt.TextFormat.PlainText)
        self._reason.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout.addWidget(self._word)
        layout.addWidget(self._reason, 1)
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
        """Show a `Safety`; other readings are ignored."""
        if not isinstance(reading, Safety):
            return
        self._arrived = reading.arrived
        self._show(reading.state, reading.reason)

    def clear(self) -> None:
        self._arrived = 0.0
        self._say("No gate", "No safety gate is running. It starts with the robot's programs.", "off")

    def _poll(self) -> None:
        if self._arrived and time.monotonic() - self._arrived > SILENT_AFTER:
            self._arrived = 0.0
            self._say("Silent", "The safety gate fell silent. Expect no protection until it is back.", "bad")

    def _show(self, state: str, reason: str) -> None:
        self._say(WORDS.get(state, state.capitalize()), reason, LEVELS.get(state, "off"))

    def _say(self, word: str, reason: str, level: str) -> None:
        reason = reason[:1].upper() + reason[1:]
        self._word.setText(word)
        if self._reason.text() != reason:
            self._reason.setText(reason)
            self._reason.setToolTip(reason)
        if self.property("level") != level:
            set_property(self, "level", level)
            restyle(self._word)  # the sheet colours them by the level of the frame around them
            restyle(self._reason)
