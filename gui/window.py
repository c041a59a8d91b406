"""The operator's window: lays the widgets out, nothing else. What they do is joined in `controller.py`."""

from __future__ import annotations

from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import QEvent, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QKeySequence, QMouseEvent
from PyQt5.QtWidgets import (
    QAbstractButton,
    QFrame,
    QLabel,
    QLineEdit,
    QMainWindow,
    QPushButton,
    QShortcut,
    QSplitter,
    QWidget,
)

from gui.drive_pad import DrivePad
from gui.status_bar import StatusBar
from gui.video_view import VideoView

_HERE = Path(__file__).resolve().parent
SIZE = QSize(1280, 720)


class OperatorWindow(QMainWindow):
    """Widgets by name, as in window.ui."""

    activation_changed = pyqtSignal(bool)
    """Whether keys that the terminal does not get come to this window."""

    address: QLineEdit
    roscoreButton: QPushButton
    sessionButton: QPushButton
    feedButton: QPushButton
    stopButton: QPushButton
    exitButton: QPushButton
    feedLabel: QLabel
    pictureLabel: QLabel
    padLabel: QLabel
    terminalLabel: QLabel
    terminalFrame: QFrame
    video: VideoView
    pad: DrivePad
    status: StatusBar
    columns: QSplitter

    def __init__(self, terminal: QWidget) -> None:
        super().__init__()
        uic.loadUi(str(_HERE / "window.ui"), self)
        self.terminal = terminal
        self.terminalFrame.layout().addWidget(terminal)
        self.columns.setStretchFactor(0, 1)
        self.columns.setStretchFactor(1, 0)
        self.columns.setSizes([SIZE.width() - 540, 504])
        for button in self.findChildren(QAbstractButton):
            if button.focusPolicy() == Qt.StrongFocus:
                # A click must not put the space bar, which stops the robot, on a button.
                button.setFocusPolicy(Qt.TabFocus)
        self.exitButton.clicked.connect(self.close)
        QShortcut(QKeySequence("Ctrl+Q"), self, activated=self.close)

    def show_on_screen(self) -> None:
        """Show it at its usual size, or as large as the screen allows."""
        available = self.screen().availableGeometry()
        self.resize(SIZE.boundedTo(available.size()))
        self.move(available.center() - self.rect().center())
        self.show()
        self.activateWindow()
        self.pad.setFocus()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A click beside everything ends typing in a field: the keys drive."""
        self.pad.setFocus()
        super().mousePressEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.ActivationChange:
            self.activation_changed.emit(self.isActiveWindow())


def themes() -> list[str]:
    """Names of the style sheets in themes/."""
    return sorted(path.stem for path in (_HERE / "themes").glob("*.qss"))


def style_sheet(theme: str) -> str:
    """The style sheet of a theme.

    Raises:
        ValueError: There is no such theme; the text names those that there are.
    """
    if theme not in themes():
        raise ValueError(f"there is no theme '{theme}'; known: {', '.join(themes())}")
    return (_HERE / "themes" / f"{theme}.qss").read_text(encoding="utf-8")
