"""Driving by `movement_command` alone: for a simulated robot that has neither a lease nor a safety gate, the walker.

There is nobody to hurt, so nobody has to be asked for the robot: every pilot's window may walk it, and the newest
command counts. The red stop is this window's own, or that of one that died before it. While it is pressed the window
repeats the command to stop, so that a program that walks the robot gets a step in at most; the simulator stops it by
itself when the window is gone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from PyQt5.QtCore import pyqtSignal

from gui.driving.signed_in import SignedIn
from gui.periodic_timer import PeriodicTimer
from telepresence.geometry import Velocity
from telepresence.teleop.lease_messages import Account
from telepresence.teleop.lease_topics import LeaseState
from telepresence.teleop.looking import Look
from telepresence.teleop.movement import Movement, movement_of

if TYPE_CHECKING:
    from gui.ros.link import RosLink

STOP_PERIOD = 100
"""[ms] between two commands to stop while the red stop is pressed."""
NO_SIMULATION = "The simulation does not run. Press Roscore start."


class MovementAccess(SignedIn):
    """A `DriveAccess` that sends forward, backward and stop.

    Args:
        link: The robot.
    Attributes:
        stopped_by: Who has pressed the red stop; empty for nobody.
    """

    stop_changed = pyqtSignal()
    """`stopped_by` has changed."""
    shared = False

    def __init__(self, link: RosLink) -> None:
        super().__init__()
        self._link = link
        self.stopped_by = ""
        self._repeat = PeriodicTimer(STOP_PERIOD, lambda: self._send(Movement.STOP), self)
        link.state_changed.connect(lambda _state: self._refresh())

    @property
    def mine(self) -> bool:
        return self.is_pilot and self.state is not None

    @property
    def comes_back(self) -> bool:
        return False

    def obstacle(self) -> str:
        if self.account is None:
            return "Sign in to drive."
        if self.state is None:
            return NO_SIMULATION
        if not self.is_pilot:
            return f"{self.account.name} may watch, not drive."
        if self.stopped_by:
            return f"{self.stopped_by} has pressed the red stop. Press it again to reset the stop."
        return ""

    def sign_in(self, account: Account) -> None:
        self.account = account
        self._refresh()

    def sign_out(self) -> None:
        self.account = None
        self._refresh()

    def set_hold(self, reason: str) -> None:
        """Do nothing: only this window would obey, and it does so already."""

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Walk forward or backward, whatever the speed; the robot takes no other velocity."""
        self._send(Movement.STOP if self.stopped_by else movement_of(vx))

    def look(self, look: Look) -> None:
        """Do nothing: the robot has no head that turns."""

    def take(self) -> None:
        """Do nothing: the robot belongs to nobody."""

    def release(self) -> None:
        """Do nothing, likewise."""

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        """Press the red stop ("stop") or reset it ("reset_stop"); other requests mean nothing here."""
        if action == "stop" and self.account is not None:
            self._send(Movement.STOP)
            self.keep_stop(self.account.name)
        elif action == "reset_stop" and self.is_pilot:
            self.keep_stop("")
        elif action == "reset_stop" and not quiet:
            self.refused.emit(self.obstacle())
        self._refresh()

    def keep_stop(self, stopped_by: str) -> None:
        """Hold the red stop for whoever has pressed it, in this window or in one that has died; empty: for nobody."""
        self.stopped_by = stopped_by
        if stopped_by:
            self._repeat.start()
        else:
            self._repeat.stop()
        self.stop_changed.emit()

    def _send(self, movement: Movement) -> None:
        self._link.send("movement", int(movement))

    def _refresh(self) -> None:
        before = self.state
        runs = self._link.state.driver and self.account is not None
        self.state = self._describe() if runs else None
        if before != self.state:
            self.changed.emit()

    def _describe(self) -> LeaseState:
        assert self.account is not None  # `_refresh` asks for that
        name = self.account.name if self.is_pilot else ""
        return LeaseState(
            epoch="", sign_in=False, pilot=name, window=self._link.node_name if name else "", asking="",
            stopped_by=self.stopped_by, hold="", other="", velocity=Velocity(0.0, 0.0, 0.0), present=(), arrived=0.0,
        )  # fmt: skip
