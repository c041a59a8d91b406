"""The operator's window: the layout of its widgets and nothing else. `gui.app.controller` connects them."""

from __future__ import annotations

from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import QEvent, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QKeySequence, QMouseEvent
from PyQt5.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QMainWindow,
    QPushButton,
    QShortcut,
    QSplitter,
    QTabWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from gui import theme
from gui.driving.drive_pad import DrivePad
from gui.driving.key_legend import KeyPicture
from gui.theme import style_sheet, themes
from gui.widgets.body_panel import BodyPanel
from gui.widgets.gate_banner import GateBanner
from gui.widgets.label import Label
from gui.widgets.link_health import LinkHealth
from gui.widgets.robot_panel import RobotPanel
from gui.widgets.sensor_view import SensorView
from gui.widgets.sound_panel import SoundPanel
from gui.widgets.status_bar import StatusBar
from gui.widgets.video_view import VideoView

__all__ = ["SIZE", "OperatorWindow", "style_sheet", "themes"]

_HERE = Path(__file__).resolve().parent
SIZE = QSize(1280, 720)
SIDE_WIDTH = 570
"""Width of the right column at first [px]; a wider window gives the rest to the camera."""
CONTROLS_HEIGHT = 322
"""Height of what is above the deck at first [px]."""
NO_TABLET = (
    "No picture of the tablet",
    "A simulated robot publishes what its tablet shows. A real one shows the page of com_cam: "
    "port 10002 of the machine that runs the robot's programs.",
)
LARGEST = 0.9
"""Share of a large screen that the window takes at first."""
UNLIMITED = 16777215
"""QWIDGETSIZE_MAX of Qt: no limit to a widget's height [px]."""
TITLE_BAR = 30
"""Height of a window manager's title bar, at most [px]."""


def place_on_screen(window: QMainWindow) -> None:
    """See `OperatorWindow.show_on_screen`."""
    screen = window.screen()
    assert screen is not None  # there is one before there is a window
    available = screen.availableGeometry()
    window.resize(SIZE.expandedTo(available.size() * LARGEST).boundedTo(available.size()))
    window.move(available.center() - window.rect().center())
    if available.height() < SIZE.height() + TITLE_BAR:
        window.showMaximized()  # else the title bar would push the status bar off the screen
    else:
        window.show()
    window.activateWindow()


class OperatorWindow(QMainWindow):
    """One robot's page. The attributes are the widgets of window.ui."""

    activation_changed = pyqtSignal(bool)
    """Whether this window receives the keys that the terminal does not get."""
    closed_by_key = pyqtSignal()
    """Ctrl+Q was pressed."""

    headerLayout: QHBoxLayout
    brand: Label
    address: QLineEdit
    addressLabel: Label
    roscoreButton: QPushButton
    sessionButton: QPushButton
    feedButton: QPushButton
    themeButton: QPushButton
    stopButton: QPushButton
    exitButton: QPushButton
    accessSlot: QHBoxLayout
    cameraTitleLayout: QHBoxLayout
    feedLabel: Label
    cameraChoice: QComboBox
    pictureLabel: Label
    snapshotButton: QPushButton
    recordButton: QPushButton
    video: VideoView
    gate: GateBanner
    health: LinkHealth
    around: SensorView
    aroundTitle: Label
    aroundLabel: Label
    bodyPanel: BodyPanel
    pad: DrivePad
    padLabel: Label
    driveSlot: QVBoxLayout
    deck: QTabWidget
    terminalPage: QWidget
    terminalLabel: Label
    terminalFrame: QFrame
    robotPage: QWidget
    robotPanel: RobotPanel
    sound: SoundPanel
    soundPage: QWidget
    tablet: VideoView
    tabletPage: QWidget
    status: StatusBar
    columns: QSplitter
    side: QSplitter

    def __init__(self, terminal: QWidget) -> None:
        super().__init__()
        uic.loadUi(str(_HERE / "window.ui"), self)
        self.terminal = terminal
        self.keys = KeyPicture(self.video)
        frame_layout, tab_bar = self.terminalFrame.layout(), self.deck.tabBar()
        assert frame_layout is not None and tab_bar is not None  # window.ui makes both
        frame_layout.addWidget(terminal)
        for splitter, sizes in (
            (self.columns, [SIZE.width() - SIDE_WIDTH - 36, SIDE_WIDTH]),
            (self.side, [CONTROLS_HEIGHT, SIZE.height() - CONTROLS_HEIGHT]),
        ):
            splitter.setSizes(sizes)
        self.columns.setStretchFactor(0, 1)
        self.columns.setStretchFactor(1, 0)
        self.side.setStretchFactor(0, 1)
        self.side.setStretchFactor(1, 1)
        self._fold = QToolButton()
        self._fold.setText("▾")
        self._fold.setToolTip("Fold this away, or back (F4)")
        self._fold.setAccessibleName("Fold the tabs away")
        self._fold.setCheckable(True)
        self._fold.setAutoRaise(True)
        self._fold.setObjectName("foldButton")
        self._fold.setShortcut("F4")
        self._fold.toggled.connect(self.fold_deck)
        self.deck.setCornerWidget(self._fold, Qt.Corner.TopRightCorner)
        self.deck.tabBarClicked.connect(lambda _index: self._fold.setChecked(False))
        tab_bar.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.cameraChoice.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.tablet.setMinimumSize(160, 100)
        self.tablet.stale_after = float("inf")
        self.tablet.clear(*NO_TABLET)
        self.cameraChoice.hide()
        for button in self.findChildren(QAbstractButton):
            if button.focusPolicy() == Qt.FocusPolicy.StrongFocus:
                # A click must not focus a button: the space bar would press it instead of stopping the robot.
                button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.recordButton.ensurePolished()
        self.recordButton.setMinimumWidth(self.recordButton.sizeHint().width())  # its text changes while it records
        self.themeButton.clicked.connect(self.change_theme)
        self.exitButton.clicked.connect(self.close)  # type: ignore[arg-type]  # PyQt5's stub: a slot returns None
        QShortcut(QKeySequence("Ctrl+Q"), self).activated.connect(self._on_close_key)

    def show_on_screen(self) -> None:
        """Show the window at its usual size; larger on a large screen, maximized on a small one."""
        place_on_screen(self)
        self.pad.setFocus()

    def put_tabs(self, tabs: QWidget) -> None:
        """Show these tabs in place of the program's name."""
        self.brand.hide()
        self.headerLayout.insertWidget(0, tabs)

    def show_terminal(self) -> None:
        """Bring the terminal to the front of the deck."""
        self.show_page(self.terminalPage)

    def show_page(self, page: QWidget) -> None:
        """Bring a page to the front of the deck."""
        self._fold.setChecked(False)
        self.deck.setCurrentWidget(page)

    def fold_deck(self, folded: bool) -> None:
        """Show only the tabs of the deck, to give its room to the sensors; or show all of it again."""
        self._fold.setText("▴" if folded else "▾")
        self._fold.setShortcut("F4")  # setText removes it
        bar, card = self.deck.tabBar(), self.deck.parentWidget()
        assert bar is not None and card is not None  # window.ui makes both
        card.setMaximumHeight(bar.sizeHint().height() + 10 if folded else UNLIMITED)
        for index in range(self.deck.count()):
            page = self.deck.widget(index)
            assert page is not None  # there is one for each index below count()
            page.setVisible(not folded and index == self.deck.currentIndex())

    def change_theme(self) -> None:
        """Switch to the next theme."""
        known = themes()
        theme.apply(known[(known.index(theme.current()) + 1) % len(known)])

    def _on_close_key(self) -> None:
        self.closed_by_key.emit()
        self.close()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A click on the background ends typing in a field: keys drive again."""
        self.pad.setFocus()
        super().mousePressEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange:
            self.activation_changed.emit(self.isActiveWindow())
