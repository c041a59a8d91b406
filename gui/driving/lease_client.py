"""The window's client of drive_lease: joins it, renews the lease, and sends signed commands.

The other side is `telepresence.teleop.drive_lease`. The lease is renewed on Qt's thread, so a window that hangs loses
the robot.
"""

from __future__ import annotations

import dataclasses
import math
import secrets
import time
from typing import TYPE_CHECKING

from gui.driving.drive_access import DriveAccess
from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer
from gui.ros.topics.drive import LeaseState
from telepresence.teleop.drive_lease import (
    NONCE,
    PILOT,
    Account,
    Command,
    Velocity,
    session_key,
    sign_command,
    sign_request,
)

if TYPE_CHECKING:
    from gui.ros.link import RosLink

LIFE_PERIOD = 250  # ms between two renewals; a lease lasts four of them
SILENCE = 1.5
"""[s] without a message from drive_lease after which it counts as gone."""
JOIN_PERIOD = 2.0
"""[s] between two attempts to join."""


class LeaseClient(DriveAccess):
    """Whether this window has the robot, and how it gets it.

    Args:
        link: The robot.
    """

    def __init__(self, link: RosLink) -> None:
        super().__init__()
        self._link = link
        self._session, self._key, self._epoch = "", b"", ""
        self._number = self._asked = 0
        self._hold = ""
        self._wants = self._joining = False
        self._sent_at = self._tried_at = self._taken_at = -math.inf
        self._join_problem = ""
        link.channel("lease").arrived.connect(self._on_state)
        self._life = PeriodicTimer(LIFE_PERIOD, self._live, self)
        self._life.start()

    @property
    def mine(self) -> bool:
        """Whether this window has the robot."""
        return bool(self._session and self.state is not None and self.state.window == self._link.node_name)

    @property
    def comes_back(self) -> bool:
        """Whether this window has lost a robot that nobody else has, and takes it back: on a busy machine it may have
        been silent for longer than a lease lasts."""
        return self._wants and (self.state is None or not (self.state.pilot or self.state.stopped_by))

    def obstacle(self) -> str:
        """Return why this window may not drive and what to do about it; empty when it may."""
        if self.account is None:
            return "Sign in to drive."
        if self.state is None:
            return "Nobody decides who drives: the node drive_lease does not run. Press Session start."
        if self._join_problem:
            return self._join_problem
        if not self.is_pilot:
            return f"{self.account.name} may watch, not drive."
        if not self.mine:
            pilot = self.state.pilot
            return f"{pilot} drives. Press Ask for it." if pilot else "Nobody drives. Press Take the robot."
        if self.state.stopped_by:
            return f"{self.state.stopped_by} has pressed the red stop. Press it again to let the robot go."
        return ""

    def sign_in(self, account: Account) -> None:
        """Act for this person from now on; a pilot takes the robot if it is free."""
        self.sign_out()
        self.account = account
        self._wants = account.role == PILOT
        self._join()
        self.changed.emit()

    def sign_out(self) -> None:
        """Give up the robot, and act for nobody."""
        if self._session:
            self.ask("leave", quiet=True)
        self.account = None
        self._session, self._join_problem = "", ""
        self._tried_at = -math.inf
        self.changed.emit()

    def set_hold(self, reason: str) -> None:
        """Let nobody drive for this reason while this window has the robot, not even a keyboard node."""
        if reason != self._hold:
            self._hold = reason
            self._send(None)

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Send a velocity: forward, left [m/s], counter-clockwise [rad/s]. It has to be repeated, see
        `telepresence.teleop.drive_lease`."""
        self._send(Velocity(vx, vy, wz))

    def take(self) -> None:
        """Take the robot, or ask the pilot for it."""
        self._wants = True
        self.ask("take")

    def release(self) -> None:
        """Release the robot for others."""
        self._wants = False
        self.ask("release")

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        """Send a request, see `DriveLease.ask`; a refusal is reported by `refused`."""
        if not self._session:
            if not quiet:
                self.refused.emit(self.obstacle() or "This window has not joined yet; try again in a moment.")
            return
        self._asked += 1
        proof = sign_request(self._key, self._asked, action, to)
        session = self._session

        def answered(answer: Answer) -> None:
            if not answer.ok and not quiet and session == self._session:
                self.refused.emit(answer.text)

        self._link.call("ask", session, self._asked, action, to, proof, then=answered)

    def _on_state(self, state: LeaseState) -> None:
        before, was_mine = self.state, self.mine
        self.state = state
        if state.epoch != self._epoch:
            self._session = ""
        if self.account is not None and not self._session:
            self._join()
        if was_mine and state.pilot and not self.mine:
            self._wants = False  # it was handed over or taken: do not take it back as soon as it is free
            self.refused.emit(f"{state.pilot} drives now.")
        if self._session and self._wants and not state.pilot:
            self._take_free()
        if before is None or dataclasses.replace(state, arrived=before.arrived) != before:
            self.changed.emit()

    def _take_free(self) -> None:
        now = time.monotonic()
        if now - self._taken_at > JOIN_PERIOD / 4:
            self._taken_at = now
            self.ask("take", quiet=True)

    def _live(self) -> None:
        now = time.monotonic()
        if self.state is not None and now - self.state.arrived > SILENCE:
            self.state = None
            self.changed.emit()
        if now - self._sent_at > LIFE_PERIOD / 2000.0:
            self._send(None)

    def _send(self, velocity: Velocity | None) -> None:
        if not self._session:
            return
        self._number += 1
        self._sent_at = time.monotonic()
        unsigned = Command(self._number, self._sent_at, velocity, self._hold)
        command = dataclasses.replace(unsigned, proof=sign_command(self._key, unsigned))
        self._link.send("command", self._session, command)

    def _join(self) -> None:
        now = time.monotonic()
        if self._joining or self.account is None or self.state is None or now - self._tried_at < JOIN_PERIOD:
            return
        self._joining, self._tried_at = True, now
        account, epoch, nonce = self.account, self.state.epoch, secrets.token_bytes(NONCE)

        def answered(answer: Answer) -> None:
            self._joining = False
            if account is not self.account:
                return
            self._join_problem = "" if answer.ok else answer.text
            if answer.ok:
                self._tried_at = -math.inf
                self._session, lease_nonce = answer.value
                self._key, self._epoch = session_key(account.key, nonce, lease_nonce), epoch
                self._number = self._asked = 0
                self._send(None)
            self.changed.emit()

        self._link.call("join", account.name, self._link.node_name, nonce, then=answered)
