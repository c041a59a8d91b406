"""One line at the bottom of the window: the last message, and the state of the links."""

from __future__ import annotations

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QFontMetrics, QResizeEvent
from PyQt5.QtWidgets import QFrame, QHBoxLayout, QSizePolicy, QWidget

from gui.styling import set_property
from gui.widgets.label import Label
from telepresence.security.outside_text import clean

CHIPS = ("faults", "master", "robot", "picture", "keys")
LONGEST = 2000
"""Characters of a message."""


class StatusBar(QFrame):
    """Shows a message on the left until the next one comes, and indicators on the right."""

    said = pyqtSignal(str, str)
    """A new message, and its level."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._text = ""
        layout = QHBoxLayout(self)
        layout.setContentsMargins(16, 0, 16, 0)
        layout.setSpacing(8)
        self._message = Label()
        self._message.setObjectName("message")
        # A long message is elided instead of widening the window.
        self._message.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        layout.addWidget(self._message, 1)
        self._chips: dict[str, Label] = {}
        for name in CHIPS:
            chip = Label()
            chip.setProperty("kind", "chip")
            layout.addWidget(chip, 0, Qt.AlignmentFlag.AlignVCenter)
            chip.hide()
            self._chips[name] = chip

    @property
    def message(self) -> str:
        return self._text

    def say(self, text: str, level: str = "info") -> None:
        """Show a message; `level` is info, good, warn or bad."""
        text = clean(text, LONGEST)
        changed, self._text = text != self._text, text
        self._message.setToolTip(text)
        self._message.setAccessibleName(text)  # screen readers would read what fits
        set_property(self._message, "level", level)
        self._fit()
        if changed:
            self.said.emit(text, level)

    def set_chip(self, name: str, text: str, level: str, tip: str = "") -> None:
        """Show an indicator of `CHIPS`, or hide it without a text; `level` is off, good, warn or bad."""
        chip = self._chips[name]
        chip.setVisible(bool(text))
        chip.setText(f"●  {text}")
        chip.setToolTip(tip)
        set_property(chip, "level", level)

    def chip(self, name: str) -> tuple[str, str]:
        """Return text and level of an indicator."""
        chip = self._chips[name]
        return chip.text().removeprefix("●  "), chip.property("level")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        metrics = QFontMetrics(self._message.font())
        self._message.setText(
            metrics.elidedText(self._text, Qt.TextElideMode.ElideRight, max(0, self._message.width() - 4))
        )
