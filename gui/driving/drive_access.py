"""What every way to a robot's wheels or legs has in common: who has signed in, who drives, who has stopped it."""

from __future__ import annotations

from typing import Protocol

from PyQt5.QtCore import pyqtBoundSignal

from telepresence.teleop.lease_messages import Account
from telepresence.teleop.lease_topics import LeaseState
from telepresence.teleop.looking import Look


class DriveAccess(Protocol):
    """Whether this window may drive the robot, and what it sends.

    Attributes:
        account: Of the person who has signed in.
        state: Who drives; None when nobody says so.
        shared: Windows hand the robot to each other.
    """

    account: Account | None
    state: LeaseState | None
    shared: bool

    @property
    def changed(self) -> pyqtBoundSignal:
        """Something in `state`, `mine` or `obstacle` has changed."""

    @property
    def refused(self) -> pyqtBoundSignal:
        """A request was refused; a sentence that says why."""

    @property
    def ended(self) -> pyqtBoundSignal:
        """The account was removed or changed, and acts no more; a sentence that says so."""

    @property
    def is_pilot(self) -> bool:
        """Whether the person who has signed in may drive at all."""

    @property
    def mine(self) -> bool:
        """Whether this window has the robot."""

    @property
    def comes_back(self) -> bool:
        """Whether this window has lost a robot that nobody else has, and takes it back."""

    def obstacle(self) -> str:
        """Return why this window may not drive and what to do about it; empty when it may."""

    def sign_in(self, account: Account) -> None:
        """Act for this person from now on."""

    def sign_out(self) -> None:
        """Act for nobody."""

    def set_hold(self, reason: str) -> None:
        """Let nobody drive for this reason while this window has the robot."""

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Send a velocity: forward, left [m/s], counter-clockwise [rad/s]; to be repeated."""

    def look(self, look: Look) -> None:
        """Send where the pilot wants to look; to be repeated. A robot without a head does nothing."""

    def take(self) -> None:
        """Take the robot, or ask the pilot for it."""

    def release(self) -> None:
        """Release the robot for others."""

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        """Send a request: stop, reset_stop, give, keep (see `telepresence.teleop.drive_lease`)."""
