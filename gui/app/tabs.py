"""One window for several robots: a page for each, and tabs to switch between them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from PyQt5.QtCore import QEvent, Qt, pyqtSignal
from PyQt5.QtGui import QKeySequence
from PyQt5.QtWidgets import QMainWindow, QShortcut, QStackedWidget, QTabBar

from gui.driving.drive_pad import DrivePad
from gui.widgets.label import caption, tip
from gui.window import OperatorWindow, place_on_screen


class RobotTabs(QMainWindow):
    """Holds one page for each robot, and can be used like a single `OperatorWindow`.

    Args:
        pages: (title, page) of each robot.
    """

    changed = pyqtSignal(int)
    """The page of this index is in front now."""

    def __init__(self, pages: Sequence[tuple[str, OperatorWindow]]) -> None:
        super().__init__()
        self.setWindowTitle("Telepresence")
        self.pages = [page for _, page in pages]
        self._stack = QStackedWidget()
        self._tabs: list[QTabBar] = []
        for title, page in pages:
            page.setWindowFlags(Qt.WindowType.Widget)
            self._stack.addWidget(page)
            page.exitButton.clicked.disconnect()
            page.exitButton.clicked.connect(self.close)  # type: ignore[arg-type]  # PyQt5's stub: a slot returns None
            page.closed_by_key.connect(self.close)  # type: ignore[arg-type]
            page.addressLabel.hide()
            page.address.setAccessibleName(f"Address of {title}")
            self._tabs.append(self._make_tabs([title for title, _ in pages]))
            page.put_tabs(self._tabs[-1])
        for index in range(len(pages)):
            QShortcut(QKeySequence(f"Ctrl+{index + 1}"), self).activated.connect(partial(self.choose, index))
        self.setMinimumSize(self.pages[0].minimumSize())
        self.setCentralWidget(self._stack)
        self._show_tabs()

    @property
    def current(self) -> int:
        """The index of the page in front."""
        return self._stack.currentIndex()

    @property
    def pad(self) -> DrivePad:
        """The drive pad of the page in front."""
        return self.pages[self.current].pad

    def choose(self, index: int) -> None:
        """Bring a page to the front."""
        if index == self.current:
            return
        self._stack.setCurrentIndex(index)
        self._show_tabs()
        self.pad.setFocus()
        self.changed.emit(index)

    def show_on_screen(self) -> None:
        """See `OperatorWindow.show_on_screen`."""
        place_on_screen(self)
        self.pad.setFocus()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.ActivationChange:
            for page in self.pages:
                page.activation_changed.emit(self.isActiveWindow())

    def _make_tabs(self, titles: Sequence[str]) -> QTabBar:
        """Make the tabs shown on one page: one for each robot; a click on another one brings its page to the front."""
        bar = QTabBar()
        bar.setObjectName("robotTabs")
        bar.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        bar.setExpanding(False)
        for number, title in enumerate(titles, 1):
            bar.setTabToolTip(bar.addTab(caption(title)), tip(f"{title} (Ctrl+{number})"))
        bar.currentChanged.connect(self._on_tab)
        return bar

    def _on_tab(self, index: int) -> None:
        # `_show_tabs` sets the bars of the other pages.
        if self.sender() is self._tabs[self.current]:
            self.choose(index)

    def _show_tabs(self) -> None:
        for bar in self._tabs:
            bar.blockSignals(True)
            bar.setCurrentIndex(self.current)
            bar.blockSignals(False)
