"""Inviting: makes links to the pilot's page, shows their QR code, copies them, and withdraws them."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QHideEvent, QShowEvent
from PyQt5.QtWidgets import QCheckBox, QComboBox, QDialog, QLineEdit, QListWidget, QListWidgetItem, QPushButton, QWidget

from gui.periodic_timer import PeriodicTimer
from gui.styling import set_property
from gui.theme import application
from gui.widgets.label import Label
from gui.widgets.qr_code import QrCode
from telepresence.page import qr_code
from telepresence.station.invite import duration
from telepresence.teleop.accounts import UserError
from telepresence.teleop.invitations import Invitation, Invitations
from telepresence.teleop.lease_messages import PILOT, WATCHER

log = logging.getLogger(__name__)

FAILED = "That failed for a reason that nobody foresaw; the window's log has it. Try again."
ROLES = ((WATCHER, "watch, and press the red stop"), (PILOT, "drive a free robot"))
HOURS = ((0.5, "30 minutes"), (2.0, "2 hours"), (24.0, "1 day"))
USUAL_HOURS = 1
"""Index of what is chosen at first."""
REFRESH_PERIOD = 2000
"""[ms] between two looks at which links hold; the page and ./stack invite make some, too."""
_VERBS = {PILOT: "Drives", WATCHER: "Watches"}


class InviteDialog(QDialog):
    """A window of its own beside the operator's: while it is in front no key drives.

    The links are in a file, which another program may hold for a moment: it is used on a thread.

    Args:
        invitations: Those of the station.
    """

    _done = pyqtSignal(object)

    roleChoice: QComboBox
    timeChoice: QComboBox
    onceBox: QCheckBox
    makeButton: QPushButton
    inviteMessage: Label
    made: QWidget
    code: QrCode
    madeLabel: Label
    linkField: QLineEdit
    copyButton: QPushButton
    links: QListWidget
    withdrawButton: QPushButton

    def __init__(self, invitations: Invitations, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        uic.loadUi(str(Path(__file__).resolve().with_name("invite_dialog.ui")), self)
        self.setWindowFlag(Qt.WindowType.WindowContextHelpButtonHint, False)
        self._invitations = invitations
        self._maker = ""
        self._visit = 0
        for role, words in ROLES:
            self.roleChoice.addItem(words, role)
        for hours, words in HOURS:
            self.timeChoice.addItem(words, hours)
        self.timeChoice.setCurrentIndex(USUAL_HOURS)
        self.makeButton.clicked.connect(self.make)
        self.copyButton.clicked.connect(self.copy)
        self.withdrawButton.clicked.connect(self.withdraw)
        self.links.itemSelectionChanged.connect(self._on_selection)
        self._done.connect(lambda then: then())
        self._refresh = PeriodicTimer(REFRESH_PERIOD, self._list, self)

    def open_for(self, maker: str) -> None:
        """Show the dialog to somebody who may invite."""
        self._maker = maker
        self.show()
        self.raise_()
        self.activateWindow()
        self.makeButton.setFocus()

    def make(self) -> None:
        """Make a link as it is chosen, and show it."""
        role, hours, once = self.roleChoice.currentData(), self.timeChoice.currentData(), self.onceBox.isChecked()

        def work() -> Callable[[], None]:
            invitation, link = self._invitations.invite(role, 3600.0 * hours, once, self._maker)
            rows = qr_code.rows(link)
            return lambda: self._show_made(invitation, link, rows)

        self._do(work, self.makeButton)
        self._list()

    def copy(self) -> None:
        """Copy the link."""
        clipboard = application().clipboard()
        assert clipboard is not None  # every platform of Qt has one
        clipboard.setText(self.linkField.text())
        self._say("The link is copied.", "good")

    def withdraw(self) -> None:
        """End the link that is chosen in the list, and who came in by it."""
        item = self.links.currentItem()
        if item is None:
            return
        id = item.data(Qt.ItemDataRole.UserRole)

        def work() -> Callable[[], None]:
            self._invitations.withdraw(id)
            return lambda: self._forget(id)

        self._do(work)
        self._list()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._list()
        self._refresh.start()

    def hideEvent(self, event: QHideEvent) -> None:
        """Nobody who comes next shall see the links of whoever was here before."""
        super().hideEvent(event)
        self._refresh.stop()
        self._visit += 1
        self._forget("")
        self.links.clear()
        self._say("")

    def _do(self, work: Callable[[], Callable[[], None]], button: QPushButton | None = None) -> None:
        """Do something on a thread, and what it returns on Qt's; a button cannot be pressed meanwhile."""
        visit = self._visit
        if button is not None:
            button.setEnabled(False)

        def run() -> None:
            try:
                then = work()
            except UserError as error:
                then = partial(self._say, str(error), "bad")
            except Exception:  # without an answer the button would stay disabled
                log.exception("the links to the pilot's page could not be used")
                then = partial(self._say, FAILED, "bad")
            self._done.emit(lambda: self._finish(then, visit, button))

        threading.Thread(target=run, name="invitations", daemon=True).start()

    def _finish(self, then: Callable[[], None], visit: int, button: QPushButton | None) -> None:
        if button is not None:
            button.setEnabled(True)
        if visit == self._visit:
            then()

    def _list(self) -> None:
        def work() -> Callable[[], None]:
            found = self._invitations.all()
            return lambda: self._show_list(found)

        self._do(work)

    def _show_made(self, invitation: Invitation, link: str, rows: list[str]) -> None:
        what = "drives a free robot" if invitation.role == PILOT else "watches, and may press the red stop,"
        who = "The first who opens it" if invitation.once else "Whoever opens it"
        self.madeLabel.setText(f"{who} {what} for {duration(invitation.ends - time.time())} from now.")
        self.linkField.setText(link)
        self.linkField.setCursorPosition(0)
        self.code.show_rows(rows)
        self.made.setProperty("invitation", invitation.id)
        self.made.show()
        self._say("")
        self.copyButton.setFocus()

    def _show_list(self, found: list[Invitation]) -> None:
        chosen = self.links.currentItem()
        chosen_id = chosen.data(Qt.ItemDataRole.UserRole) if chosen else None
        self.links.clear()
        for one in found:
            used = f"used {one.used} times" if one.used > 1 else "used" if one.used else "not used yet"
            words = f"{_VERBS[one.role]} for {duration(one.ends - time.time())}{', once' if one.once else ''}; {used}"
            item = QListWidgetItem(f"{words}; made by {one.maker}" if one.maker else words)
            item.setData(Qt.ItemDataRole.UserRole, one.id)
            self.links.addItem(item)
            if one.id == chosen_id:
                self.links.setCurrentItem(item)
        self._on_selection()

    def _forget(self, id: str) -> None:
        """Show a link no more, once it is withdrawn; any for an empty id."""
        if not id or self.made.property("invitation") == id:
            self.made.hide()
            self.linkField.clear()
            self.code.show_rows([])
        if id:
            self._say("The link is withdrawn; who came in by it is out.", "good")

    def _on_selection(self) -> None:
        self.withdrawButton.setEnabled(bool(self.links.selectedItems()))

    def _say(self, text: str, level: str = "info") -> None:
        self.inviteMessage.setText(text)
        set_property(self.inviteMessage, "level", level)
