"""What every way to a robot's wheels or legs has in common: who has signed in, who drives, who has stopped it."""

from __future__ import annotations

from PyQt5.QtCore import QObject, pyqtSignal

from telepresence.teleop.drive_lease import PILOT, Account
from telepresence.teleop.lease_topics import LeaseState


class DriveAccess(QObject):
    """Whether this window may drive the robot, and what it sends.

    Attributes:
        shared: Windows hand the robot to each other.
        comes_back: This window has lost a robot that nobody else has, and takes it back.
    """

    changed = pyqtSignal()
    """Something in `state`, `mine` or `obstacle` has changed."""
    refused = pyqtSignal(str)
    """A request was refused; a sentence that says why."""

    ended = pyqtSignal(str)
    """The account was removed or changed, and acts no more; a sentence that says so."""

    shared = True

    def __init__(self) -> None:
        super().__init__()
        self.account: Account | None = None
        self.state: LeaseState | None = None
        """Who drives; None when nobody says so."""

    @property
    def is_pilot(self) -> bool:
        return self.account is not None and self.account.role == PILOT

    @property
    def mine(self) -> bool:
        """Whether this window has the robot."""
        raise NotImplementedError

    @property
    def comes_back(self) -> bool:
        return False

    def obstacle(self) -> str:
        """Return why this window may not drive and what to do about it; empty when it may."""
        raise NotImplementedError

    def sign_in(self, account: Account) -> None:
        """Act for this person from now on."""
        raise NotImplementedError

    def sign_out(self) -> None:
        """Act for nobody."""
        raise NotImplementedError

    def set_hold(self, reason: str) -> None:
        """Let nobody drive for this reason while this window has the robot."""
        raise NotImplementedError

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Send a velocity: forward, left [m/s], counter-clockwise [rad/s]; to be repeated."""
        raise NotImplementedError

    def take(self) -> None:
        """Take the robot, or ask the pilot for it."""
        raise NotImplementedError

    def release(self) -> None:
        """Release the robot for others."""
        raise NotImplementedError

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        """Send a request: stop, reset_stop, give, keep (see `telepresence.teleop.drive_lease`)."""
        raise NotImplementedError
