"""Shows who drives, and lets people take, ask for, hand over and release the robot, and sign out."""

from __future__ import annotations

from pathlib import Path

from PyQt5 import uic
from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import QAction, QMenu, QPushButton, QToolButton, QWidget

from gui.driving.drive_access import DriveAccess
from gui.styling import set_property
from gui.widgets.label import caption, tip
from telepresence.security.outside_text import clean
from telepresence.teleop.invitations import may_invite

LONGEST = 16
"""Characters of a name on the button: a longer one would widen the window."""


class AccessBar(QWidget):
    """Buttons and menu for a `DriveAccess`.

    Args:
        access: The lease of the robot that this bar is about.
        can_sign_out: Whether there are accounts; without them nobody signs in or out.
    """

    sign_out_wanted = pyqtSignal()
    invite_wanted = pyqtSignal()
    help_wanted = pyqtSignal()
    guide_keys_wanted = pyqtSignal(bool)
    """Keys and speeds as in the Robotino guide, or ours."""

    takeButton: QPushButton
    keepButton: QPushButton
    inviteButton: QPushButton
    menuButton: QToolButton

    def __init__(self, access: DriveAccess, can_sign_out: bool, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        uic.loadUi(str(Path(__file__).resolve().with_name("access_bar.ui")), self)
        self._access, self._can_sign_out = access, can_sign_out
        self._guide_keys = QAction("Keys as in the guide: Q turns right, 0.05 m/s", self)
        self._guide_keys.setCheckable(True)
        self._guide_keys.toggled.connect(self.guide_keys_wanted)
        self._menu = QMenu(self)
        self._menu.aboutToShow.connect(self._fill_menu)
        self.menuButton.setMenu(self._menu)
        self.keepButton.setShortcut("Shift+F3")
        self.takeButton.clicked.connect(self._on_take)
        self.keepButton.clicked.connect(lambda: access.ask("keep"))
        self.inviteButton.clicked.connect(self.invite_wanted)
        access.changed.connect(self.show_access)
        self.show_access()

    def show_access(self) -> None:
        """Show the current state of the lease."""
        access, state = self._access, self._access.state
        asking = clean(state.asking, LONGEST) if state is not None and access.mine else ""
        if state is None:
            text, level = "Not connected", "off"
        elif access.mine:
            text, level = (f"{asking} asks to drive", "warn") if asking else ("You drive", "good")
        elif state.pilot:
            text, level = f"{clean(state.pilot, LONGEST)} drives", "warn"
        else:
            text, level = "Nobody drives", "off"
        if state is not None and state.other and not access.mine:
            text, level = f"{clean(state.other.strip('/'), LONGEST)} drives", "warn"
        button, account = self.menuButton, access.account
        who = f"You are {account.name}, {account.role}. " if account else ""
        here = f"Here: {', '.join(name for name, _ in state.present)}. " if state and state.present else ""
        button.setText(caption(f"●  {text}"))
        button.setShortcut("F2")  # setText removes it
        button.setToolTip(tip(f"{who}{here}Hand over, sign out: F2"))
        set_property(button, "level", level)
        self.takeButton.setVisible(bool(asking) or (state is not None and access.is_pilot and not access.mine))
        text = "Hand over" if asking else "Ask for it" if state and state.pilot else "Take the robot"
        if text != self.takeButton.text():
            self.takeButton.setText(text)
            self.takeButton.setShortcut("F3")  # setText removes it
        self.keepButton.setVisible(bool(asking))
        # With another button beside it and long names there is no room; the menu has it always.
        self.inviteButton.setVisible(self._may_invite and access.mine and not asking)

    @property
    def _may_invite(self) -> bool:
        access = self._access
        return access.shared and access.account is not None and may_invite(access.account)

    @property
    def guide_keys(self) -> bool:
        """Whether keys and speeds are those of the Robotino guide."""
        return self._guide_keys.isChecked()

    def set_guide_keys(self, wanted: bool) -> None:
        """Choose keys and speeds of the Robotino guide, or ours."""
        self._guide_keys.setChecked(wanted)

    def _on_take(self) -> None:
        if self._access.mine:
            self._access.ask("give")
        else:
            self._access.take()

    def _fill_menu(self) -> None:
        access, state = self._access, self._access.state
        self._menu.clear()
        if access.account is not None:
            self._menu.addSection(caption(f"{access.account.name}, {access.account.role}"))
        if state is not None and access.mine:
            for name, window in state.present:
                if window != state.window and name.endswith("(pilot)"):
                    self._menu.addAction(
                        caption(f"Hand over to {name}"), lambda window=window: access.ask("give", window)
                    )
            if access.shared:
                self._menu.addAction("Leave the robot to others", access.release)
        elif access.is_pilot and state is not None:
            self._menu.addAction(self.takeButton.text(), access.take)
        if access.shared:
            self._menu.addAction(self._guide_keys)
        if self._may_invite:
            self._menu.addAction("Invite somebody", self.invite_wanted.emit)
        self._menu.addAction("Keys and help (F1)", self.help_wanted.emit)
        if self._can_sign_out:
            self._menu.addAction("Sign out", self.sign_out_wanted.emit)
