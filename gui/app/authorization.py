"""Who may see and do what: the sign-in page covers the window whenever nobody is signed in."""

from __future__ import annotations

import getpass
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from PyQt5.QtCore import QObject
from PyQt5.QtWidgets import QStackedWidget

from gui.app.invite_dialog import InviteDialog
from gui.app.sign_in import SignInPage
from telepresence.teleop.accounts import Users
from telepresence.teleop.invitations import Invitations, beside, may_invite
from telepresence.teleop.lease_messages import PILOT, Account

if TYPE_CHECKING:
    from gui.app.capture import Capture
    from gui.app.controller import Controller
    from gui.app.tabs import RobotTabs
    from gui.window import OperatorWindow

SIGNED_OUT = "Sign in first."
FOR_PILOTS = "You watch. The terminal is for pilots: what is typed there reaches the robot."


class Lockable(Protocol):
    """A terminal, or several of them."""

    def start(self) -> None:
        """Open it."""

    def deny(self, reason: str) -> None:
        """Let nobody type, and show why; an empty string gives it back."""


class Authorization(QObject):
    """Shows window, terminal and controls to people as their roles allow.

    Args:
        window, terminal: What is hidden.
        controllers: One for each robot.
        users: The accounts; None lets everybody in as a pilot.
        captures: Snapshots and recordings of each robot.
    """

    def __init__(
        self,
        window: OperatorWindow | RobotTabs,
        terminal: Lockable,
        controllers: list[Controller],
        users: Users | None,
        captures: Sequence[Capture] = (),
    ) -> None:
        super().__init__(window)
        self._window, self._terminal, self._controllers, self._captures = window, terminal, controllers, captures
        self.page: SignInPage | None = None
        self.account: Account | None = None
        self.invite_dialog = InviteDialog(Invitations(beside(users.path if users else None)), window)
        for controller in controllers:
            controller.bar.invite_wanted.connect(self.invite)
        if users is None:
            self.admit(Account(getpass.getuser(), PILOT))
            return
        self.page = SignInPage(users)
        self._main = window.takeCentralWidget()
        self._pages = QStackedWidget()
        self._pages.addWidget(self._main)
        self._pages.addWidget(self.page)
        window.setCentralWidget(self._pages)
        self.page.signed_in.connect(self.admit)
        for controller in controllers:
            controller.bar.sign_out_wanted.connect(self.dismiss)
            controller.access.ended.connect(self._on_ended)
        for capture in captures:
            capture.said.connect(lambda text, _level: self._say_signed_out(text))
        self.dismiss()

    def admit(self, account: Account) -> None:
        """Show the window to this person, as far as their role allows."""
        self.account = account
        if self.page is not None:
            self._pages.setCurrentWidget(self._main)
        for controller in self._controllers:
            controller.admit(account)
        if account.role == PILOT:
            self._terminal.deny("")
            self._terminal.start()
        else:
            self._terminal.deny(FOR_PILOTS)
        self._window.pad.setFocus()

    def invite(self) -> None:
        """Let who has signed in make links to the pilot's page."""
        if self.account is not None and may_invite(self.account):
            self.invite_dialog.open_for(self.account.name)

    def dismiss(self) -> None:
        """Hide pictures and controls from everybody. What runs in the terminal keeps running: others may need it."""
        self.account = None
        self.invite_dialog.hide()
        for controller in self._controllers:
            controller.dismiss()
        self._terminal.deny(SIGNED_OUT)
        self._pages.setCurrentWidget(self.page)
        for capture in self._captures:
            capture.leave()

    def _on_ended(self, reason: str) -> None:
        """Somebody whose account was removed sees nothing either."""
        self.dismiss()
        self._say_signed_out(reason)

    def _say_signed_out(self, text: str) -> None:
        if self.page is not None and self.account is None:
            self.page.add(text)
