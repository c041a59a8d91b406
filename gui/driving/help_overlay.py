"""A page over the window that lists all keys and the gamepad's buttons."""

from __future__ import annotations

from collections.abc import Callable

from PyQt5.QtCore import QEvent, QObject, Qt, pyqtSignal
from PyQt5.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PyQt5.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QVBoxLayout, QWidget

from gui import theme
from gui.driving.drive_pad import WANTS_LETTERS
from gui.driving.key_legend import KeyLegend
from gui.widgets.label import Label

Section = tuple[str, tuple[tuple[str, str], ...]]
"""A heading, and rows of (keys, what they do)."""
USUAL_TURNS = (("Q  E   ←  →", "turn left, turn right"),)
GUIDE_TURNS = (("←  →", "turn left, turn right"), ("Q  E", "as in the guide: turn right, turn left"))
WALKER: tuple[Section, ...] = (
    ("Walk: hold", (("W  S   ↑  ↓", "forward, backward"), ("Space", "stop"))),
    (
        "Gamepad",
        (
            ("cross, left stick", "up and down: forward, backward"),
            ("B", "stop"),
            ("button 0", "restart the simulation"),
        ),
    ),
)
GENERAL: tuple[Section, ...] = (
    (
        "Stop and go",
        (
            ("Esc", "red stop: nothing drives until it is reset"),
            ("Shift+Esc", "reset the red stop"),
            ("F3", "take, ask for or hand over the robot"),
            ("Shift+F3", "keep it when somebody asks"),
            ("F2", "who is here; hand over; sign out"),
        ),
    ),
    (
        "Window",
        (
            ("F1", "this page"),
            ("F4", "fold the lower right away, or back"),
            ("F6", "keys go to the terminal, or back here"),
            ("Tab", "to buttons and choices: Space, arrows"),
            ("Ctrl+1, 2", "the robot in that tab"),
            ("Ctrl+Q", "exit"),
        ),
    ),
)
GAMEPAD: Section = (
    "Gamepad",
    (
        ("LB", "hold to drive"),
        ("left stick, cross", "drive; the cross creeps"),
        ("right stick", "turn; with LT Pepper's head"),
        ("RB", "fast"),
        ("B", "stop"),
        ("button 0", "hold 1 s: restart the simulation"),
    ),
)


def sections(by_movement: bool, guide_keys: bool) -> tuple[Section, ...]:
    """Return what the page lists: two sections for its first column, two for its second.

    Args:
        by_movement: The robot walks forward and backward only.
        guide_keys: Q and E turn as in the Robotino guide.
    """
    if by_movement:
        return WALKER[0], GENERAL[0], WALKER[1], GENERAL[1]
    drive = (
        ("W  S   ↑  ↓", "forward, backward"),
        ("A  D", "left, right, without turning"),
        *(GUIDE_TURNS if guide_keys else USUAL_TURNS),
        ("Space", "stop"),
        ("PgUp  PgDn", "faster, slower"),
        ("picture", "hold the mouse on the floor: drive there"),
        ("I J K L", "turn Pepper's head; or drag the picture"),
        ("H   G", "look ahead; look where I drive"),
    )
    return ("Drive: hold", drive), GENERAL[0], GAMEPAD, GENERAL[1]


class HelpOverlay(QFrame):
    """Covers its parent until a key or a click closes it. Nothing drives meanwhile.

    Args:
        parent: The window.
        contents: Returns what to list when the page is opened, and whether keys typed in the terminal drive.
    """

    shown = pyqtSignal(bool)
    """It covers the window from now on, or no more."""

    def __init__(self, parent: QWidget, contents: Callable[[], tuple[tuple[Section, ...], bool]]) -> None:
        super().__init__(parent)
        self._covered, self._contents = parent, contents
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Keys and help")
        self.setProperty(WANTS_LETTERS, True)
        self._around = QVBoxLayout(self)
        self._card: QFrame | None = None
        self._before: QWidget | None = None
        parent.installEventFilter(self)
        self.hide()

    def open(self) -> None:
        """Show it over all of the parent."""
        window = self.window()
        self._before = window.focusWidget() if window is not None else None
        self._fill()
        self.setGeometry(self._covered.rect())
        self.show()
        self.raise_()
        self.setFocus()
        self.shown.emit(True)

    def _fill(self) -> None:
        """Make the card anew: what the keys do may have changed."""
        if self._card is not None:
            self._around.removeWidget(self._card)
            self._card.hide()
            self._card.deleteLater()
        listed, with_terminal = self._contents()
        self._card = card = QFrame()
        card.setProperty("kind", "card")
        columns = QHBoxLayout(card)
        columns.setContentsMargins(28, 24, 28, 24)
        columns.setSpacing(40)
        for pair in (listed[:2], listed[2:]):
            column = QVBoxLayout()
            column.setSpacing(14)
            for title, rows in pair:
                column.addLayout(_section(title, rows))
            column.addStretch(1)
            columns.addLayout(column)
        if with_terminal:
            columns.addWidget(KeyLegend(), 0, Qt.AlignmentFlag.AlignTop)
        self._around.addWidget(card, 0, Qt.AlignmentFlag.AlignCenter)

    def shut(self) -> None:
        """Hide the page and return the focus."""
        if not self.isVisible():
            return
        self.hide()
        self.shown.emit(False)
        if self._before is not None:
            self._before.setFocus()

    def toggle(self) -> None:
        """Open or close the page."""
        if self.isVisible():
            self.shut()
        else:
            self.open()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize and self.isVisible():
            self.setGeometry(self._covered.rect())
        return False

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Close the page as any key does: Tab would go to a button beneath it."""
        self.shut()
        return True

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not event.isAutoRepeat():
            self.shut()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.shut()

    def paintEvent(self, event: QPaintEvent) -> None:
        QPainter(self).fillRect(self.rect(), theme.colour("ground", 0.88))


def _section(title: str, rows: tuple[tuple[str, str], ...]) -> QGridLayout:
    grid = QGridLayout()
    grid.setHorizontalSpacing(16)
    grid.setVerticalSpacing(6)
    heading = Label(title)
    heading.setProperty("role", "title")
    grid.addWidget(heading, 0, 0, 1, 2)
    for row, (keys, what) in enumerate(rows, start=1):
        cap = Label(keys)
        cap.setProperty("kind", "legend")
        cap.setAlignment(Qt.AlignmentFlag.AlignCenter)
        grid.addWidget(cap, row, 0)
        grid.addWidget(Label(what), row, 1)
    return grid
