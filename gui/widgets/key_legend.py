"""A legend of the keys that drive when they are typed into the terminal."""

from __future__ import annotations

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QFrame, QGridLayout, QLabel, QWidget

KEYS = (("u", "i", "o"), ("j", "k", "l"), ("m", ",", "."))
SYMBOLS = (("↰", "↑", "↱"), ("↶", "stop", "↷"), ("↲", "↓", "↳"))
NOTES = "A key is latched until the next one.\nShift: sideways.   q / z: faster, slower."


class KeyLegend(QFrame):
    """Shows which letter drives where."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(6)
        layout.setVerticalSpacing(4)
        heading = QLabel("Typed in the terminal")
        heading.setProperty("role", "detail")
        layout.addWidget(heading, 0, 0, 1, 3)
        for row, (keys, symbols) in enumerate(zip(KEYS, SYMBOLS, strict=True)):
            for column, (key, symbol) in enumerate(zip(keys, symbols, strict=True)):
                cap = QLabel(f"<b>{key}</b>&nbsp; {symbol}")
                cap.setTextFormat(Qt.TextFormat.RichText)
                cap.setAlignment(Qt.AlignmentFlag.AlignCenter)
                cap.setProperty("kind", "legend")
                layout.addWidget(cap, row + 1, column)
        notes = QLabel(NOTES)
        notes.setProperty("role", "note")
        notes.setWordWrap(True)
        layout.addWidget(notes, 4, 0, 1, 3)
