"""The part of a way to drive that all of them keep alike: who has signed in at this window, and who drives."""

from __future__ import annotations

from PyQt5.QtCore import QObject, pyqtSignal

from telepresence.teleop.lease_messages import PILOT, Account
from telepresence.teleop.lease_topics import LeaseState


class SignedIn(QObject):
    """See `gui.driving.drive_access.DriveAccess` about each of these."""

    changed = pyqtSignal()
    refused = pyqtSignal(str)
    ended = pyqtSignal(str)

    def __init__(self) -> None:
        super().__init__()
        self.account: Account | None = None
        self.state: LeaseState | None = None

    @property
    def is_pilot(self) -> bool:
        return self.account is not None and self.account.role == PILOT
