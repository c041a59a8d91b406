"""The keys that drive, as pictures: those of the window, and those that are typed into the terminal."""

from __future__ import annotations

from typing import NamedTuple

from PyQt5.QtCore import QEvent, QObject, Qt
from PyQt5.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QWidget

from gui.driving.drive_pad import MOVES
from gui.styling import set_property
from gui.widgets.label import Label

MARGIN = 12
"""Below the picture of the keys [px]."""
WORDS = 52
"""Height of what is written in the middle of the place for the robot's picture, from its centre down [px]."""


class KeyTable(NamedTuple):
    """What a legend shows: a heading, rows of (key, symbol), and notes."""

    heading: str
    rows: tuple[tuple[tuple[str, str], ...], ...]
    notes: str


IN_WINDOW = KeyTable(
    "In this window: hold",
    tuple(tuple((move.letter, move.symbol) for move in MOVES.values() if move.row == row) for row in (0, 1)),
    "Space stops, Esc is the red stop.\nPgUp / PgDn: faster, slower.",
)
IN_TERMINAL = KeyTable(
    "Typed in the terminal",
    (
        (("u", "↰"), ("i", "↑"), ("o", "↱")),
        (("j", "↶"), ("k", "stop"), ("l", "↷")),
        (("m", "↲"), (",", "↓"), (".", "↳")),
    ),
    "A key is latched until the next one.\nShift: sideways.   q / z: faster, slower.",
)


class KeyLegend(QFrame):
    """Shows which key drives where."""

    def __init__(self, table: KeyTable = IN_TERMINAL, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(6)
        layout.setVerticalSpacing(4)
        self._heading = Label(table.heading)
        self._heading.setProperty("role", "detail")
        layout.addWidget(self._heading, 0, 0, 1, 3)
        self._caps: list[Label] = []
        for row, keys in enumerate(table.rows, start=1):
            for column in range(len(keys)):
                cap = Label()
                cap.setTextFormat(Qt.TextFormat.RichText)
                cap.setAlignment(Qt.AlignmentFlag.AlignCenter)
                cap.setProperty("kind", "legend")
                layout.addWidget(cap, row, column)
                self._caps.append(cap)
        notes = Label(table.notes)
        notes.setProperty("role", "note")
        layout.addWidget(notes, len(table.rows) + 1, 0, 1, 3)
        layout.setRowStretch(len(table.rows) + 2, 1)
        self.show_rows(table.rows)

    def show_rows(self, rows: tuple[tuple[tuple[str, str], ...], ...]) -> None:
        """Show other (key, symbol) in the same places; none where the key is an empty string."""
        for cap, (key, symbol) in zip(self._caps, (pair for row in rows for pair in row), strict=True):
            cap.setText(f"<b>{key}</b>&nbsp; {symbol}")
            cap.setVisible(bool(key))

    def set_used(self, used: bool) -> None:
        """Highlight these keys, because they are the ones that count now, or dim them."""
        for part in (self._heading, *self._caps):
            set_property(part, "used", "yes" if used else "no")


class KeyPicture(QFrame):
    """Both legends side by side at the bottom of `place`, as long as no robot's picture is there and they have room."""

    def __init__(self, place: QWidget) -> None:
        super().__init__(place)
        self.setAccessibleName("The keys that drive")
        self.window_keys, self.terminal_keys = KeyLegend(IN_WINDOW), KeyLegend(IN_TERMINAL)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(36)
        layout.addWidget(self.window_keys)
        layout.addWidget(self.terminal_keys)
        self._place, self._wanted = place, True
        place.installEventFilter(self)
        self._fit()

    def set_wanted(self, wanted: bool) -> None:
        """Show the legends, or leave the place to the robot's picture."""
        self._wanted = wanted
        self._fit()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in (QEvent.Type.Resize, QEvent.Type.Show):
            self._fit()
        return False

    def _fit(self) -> None:
        place, size = self._place, self.sizeHint()
        left, top = (place.width() - size.width()) // 2, place.height() - size.height() - MARGIN
        self.setGeometry(left, top, size.width(), size.height())
        self.setVisible(self._wanted and left >= MARGIN and top >= place.height() // 2 + WORDS)
