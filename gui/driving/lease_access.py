"""The window's way to drive: by the lease of drive_lease, which windows hand to each other."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from gui.driving.signed_in import SignedIn
from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer
from telepresence.teleop.key_agreement import Claim
from telepresence.teleop.lease_client import LIFE_PERIOD, LeaseClient
from telepresence.teleop.lease_messages import Account, SignedCommand
from telepresence.teleop.lease_topics import LeaseState
from telepresence.teleop.looking import Look, LookCommand

if TYPE_CHECKING:
    from gui.ros.link import RosLink

CHECK_PERIOD = 100  # ms between two looks whether drive_lease is silent


class LeaseAccess(SignedIn):
    """A `DriveAccess` by a `LeaseClient` on Qt's thread: a window that hangs loses the robot.

    Args:
        link: The robot.
    """

    shared = True

    def __init__(self, link: RosLink) -> None:
        super().__init__()
        self.client = LeaseClient(_Link(link), self._on_changed, self.refused.emit, self._on_ended)
        link.channel("lease").arrived.connect(self._on_state)
        self._life = PeriodicTimer(round(1000 * LIFE_PERIOD), self.client.renew, self)
        self._life.start()
        self._checks = PeriodicTimer(CHECK_PERIOD, self.client.check, self)
        self._checks.start()

    @property
    def mine(self) -> bool:
        return self.client.mine

    @property
    def comes_back(self) -> bool:
        return self.client.comes_back

    def obstacle(self) -> str:
        return self.client.obstacle()

    def sign_in(self, account: Account) -> None:
        """Act for this person from now on; a pilot takes the robot if it is free."""
        self.client.sign_in(account)

    def sign_out(self) -> None:
        self.client.sign_out()

    def set_hold(self, reason: str) -> None:
        self.client.set_hold(reason)

    def drive(self, vx: float, vy: float, wz: float) -> None:
        self.client.drive(vx, vy, wz)

    def look(self, look: Look) -> None:
        self.client.look(look)

    def take(self) -> None:
        self.client.take()

    def release(self) -> None:
        self.client.release()

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        self.client.ask(action, to, quiet)

    def _on_state(self, state: LeaseState) -> None:
        self.client.receive(state)
        self.state = self.client.state

    def _on_changed(self) -> None:
        self.account, self.state = self.client.account, self.client.state
        self.changed.emit()

    def _on_ended(self, reason: str) -> None:
        self.account = None
        self.ended.emit(reason)


class _Link:
    """The services and topics of drive_lease, as the window's link has them."""

    def __init__(self, link: RosLink) -> None:
        self._link = link

    @property
    def node_name(self) -> str:
        return self._link.node_name

    def send(self, session: str, command: SignedCommand) -> None:
        self._link.send("command", session, command)

    def send_look(self, session: str, command: LookCommand) -> None:
        self._link.send("look", session, command)

    def join(self, claim: Claim, session: str, proof: bytes, then: Callable[[Answer], None]) -> None:
        self._link.call("join", claim, session, proof, then=then)

    def ask(
        self, session: str, number: int, action: str, to: str, proof: bytes, then: Callable[[Answer], None]
    ) -> None:
        self._link.call("ask", session, number, action, to, proof, then=then)
