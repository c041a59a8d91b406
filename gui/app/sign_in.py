"""The page that is shown until somebody has signed in."""

from __future__ import annotations

import logging
import threading
import time
from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QShowEvent
from PyQt5.QtWidgets import QLineEdit, QPushButton, QWidget

from gui.widgets.label import Label
from telepresence.teleop.accounts import UserError, Users
from telepresence.teleop.lease_messages import Account

log = logging.getLogger(__name__)

FAILED = "The check of the password failed for a reason that nobody foresaw; the window's log has it. Try again."
NO_ACCOUNTS = (
    "There is no account yet. Make one in a terminal on this machine:\n"
    "./stack exec python -m gui.users add NAME --role pilot"
)


class SignInPage(QWidget):
    """Asks for name and password. The check takes a tenth of a second, or seconds after many wrong passwords, and runs
    on a thread of its own; what is typed meanwhile is checked after it.

    Args:
        users: The accounts.
    """

    signed_in = pyqtSignal(object)
    """Account, with its key."""

    _checked = pyqtSignal(object)
    _waits = pyqtSignal(float)

    nameField: QLineEdit
    passwordField: QLineEdit
    signInButton: QPushButton
    signInMessage: Label

    def __init__(self, users: Users, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        uic.loadUi(str(Path(__file__).resolve().with_name("sign_in.ui")), self)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._users = users
        self.nameField.returnPressed.connect(self.passwordField.setFocus)
        self.passwordField.returnPressed.connect(self.try_sign_in)
        self.signInButton.clicked.connect(self.try_sign_in)
        self._again = False
        self._checked.connect(self._on_checked)
        self._waits.connect(lambda seconds: self.say(f"After many wrong passwords this one waits for {seconds:.0f} s."))

    def try_sign_in(self) -> None:
        """Check the name and password in the fields."""
        name, password = self.nameField.text(), self.passwordField.text()
        if not self.signInButton.isEnabled():
            self._again = True
            return
        if not name.strip() or not password:
            self.say("Type your name and your password.")
            return
        self.signInButton.setEnabled(False)
        self.passwordField.clear()
        self._again = False
        threading.Thread(target=self._check, args=(name, password), name="sign-in", daemon=True).start()

    def say(self, text: str) -> None:
        """Show a sentence under the fields."""
        self.signInMessage.setText(text)

    def add(self, text: str) -> None:
        """Show a sentence below those that are there, unless it is one of them."""
        lines = self.signInMessage.text().splitlines()
        if text not in lines:
            self.say("\n".join([*lines, text]))

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.say("")
        try:
            if not self._users.all():
                self.say(NO_ACCOUNTS)
        except UserError as error:
            self.say(str(error))
        (self.passwordField if self.nameField.text() else self.nameField).setFocus()

    def _check(self, name: str, password: str) -> None:
        try:
            self._checked.emit(self._users.check(name, password, sleep=self._wait))
        except UserError as error:
            self._checked.emit(error)
        except Exception:  # without an answer the button would stay disabled, and nobody could sign in any more
            log.exception("the check of a password failed")
            self._checked.emit(UserError(FAILED))

    def _on_checked(self, result: Account | UserError) -> None:
        self.signInButton.setEnabled(True)
        if isinstance(result, Account):
            self.passwordField.clear()
            self.say("")
            self.signed_in.emit(result)
        else:
            self.say(str(result))
            self.passwordField.setFocus()
            if self._again and self.passwordField.text():
                self.try_sign_in()

    def _wait(self, seconds: float) -> None:
        """Wait for this try's turn; on the thread of the check."""
        self._waits.emit(seconds)
        time.sleep(seconds)
