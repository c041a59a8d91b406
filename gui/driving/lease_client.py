"""The window's client of drive_lease: joins it, renews the lease, and sends signed commands.

The other side is `telepresence.teleop.drive_lease`. The lease is renewed on Qt's thread, so a window that hangs loses
the robot.
"""

from __future__ import annotations

import dataclasses
import hmac
import math
import time
from typing import TYPE_CHECKING

from gui.driving.drive_access import DriveAccess
from gui.periodic_timer import PeriodicTimer
from gui.ros.channels import Answer
from gui.ros.topics.drive import LeaseState
from telepresence.teleop.drive_lease import PILOT, Account, Command, Velocity
from telepresence.teleop.key_agreement import WindowSide
from telepresence.teleop.lease_messages import (
    MOST_TEXT,
    Reply,
    sign_command,
    sign_join,
    sign_joined,
    sign_reply,
    sign_request,
)

if TYPE_CHECKING:
    from gui.ros.link import RosLink

LIFE_PERIOD = 250  # ms between two renewals; a lease lasts four of them
CHECK_PERIOD = 100  # ms between two looks whether drive_lease is silent
SILENCE = 0.7
"""[s] without a message from drive_lease, which repeats its state every 0.2 s, after which it counts as gone."""
JOIN_PERIOD = 2.0
"""[s] between two attempts to join after a refusal."""
UNANSWERED_PERIOD = 0.2
"""[s] between two attempts to join that nobody has answered: drive_lease was just started, or has died meanwhile."""
MISSED = 0.2
"""[s] for which `drive/state` may lack this window before it asks why."""
IMPOSTOR = "What answers as drive_lease cannot prove that it is this robot's: somebody else may pretend to be it."


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
        self._wants = False
        self._joining = ""
        """The epoch of the drive_lease that is asked to let this window join."""
        self._sent_at = self._join_at = self._taken_at = -math.inf
        self._join_problem = ""
        self._missed_at = math.inf
        link.channel("lease").arrived.connect(self._on_state)
        self._life = PeriodicTimer(LIFE_PERIOD, self._live, self)
        self._life.start()
        self._checks = PeriodicTimer(CHECK_PERIOD, self._check_silence, self)
        self._checks.start()

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
        self._join_at = -math.inf
        self.changed.emit()

    def set_hold(self, reason: str) -> None:
        """Let nobody drive for this reason while this window has the robot, not even a keyboard node."""
        if reason[:MOST_TEXT] != self._hold:
            self._hold = reason[:MOST_TEXT]
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
        number, session, key = self._asked, self._session, self._key
        proof = sign_request(key, number, action, to)

        def answered(answer: Answer) -> None:
            if session != self._session or answer.value is None:  # it was asked before, or nobody has answered
                if not answer.ok and not quiet and session == self._session:
                    self.refused.emit(answer.text)
                return
            ended, reply_proof = answer.value
            if not hmac.compare_digest(reply_proof, sign_reply(key, number, Reply(answer.ok, answer.text, ended))):
                # drive_lease has forgotten this window, or it is somebody else who answers: prove each other again.
                self._session = ""
                self._join()
            elif ended:
                self._end(answer.text)
                return
            if not answer.ok and not quiet:
                self.refused.emit(answer.text)

        self._link.call("ask", session, number, action, to, proof, then=answered)

    def _end(self, reason: str) -> None:
        """Act for nobody any more: the account was removed or changed."""
        self._session = ""
        self.sign_out()
        self.ended.emit(reason)

    def _on_state(self, state: LeaseState) -> None:
        before, was_mine = self.state, self.mine
        self.state = state
        if state.epoch != self._epoch:
            self._session = ""
        self._ask_if_missed(state)
        if self.account is not None and not self._session:
            self._join()
        if was_mine and state.pilot and not self.mine:
            self._wants = False  # it was handed over or taken: do not take it back as soon as it is free
            self.refused.emit(f"{state.pilot} drives now.")
        if self._session and self._wants and not state.pilot:
            self._take_free()
        if before is None or dataclasses.replace(state, arrived=before.arrived) != before:
            self.changed.emit()

    def _ask_if_missed(self, state: LeaseState) -> None:
        if not self._session or any(node == self._link.node_name for _, node in state.present):
            self._missed_at = math.inf
            return
        now = time.monotonic()
        self._missed_at = min(self._missed_at, now)
        if now - self._missed_at >= MISSED:
            self._missed_at = now
            self.ask("present", quiet=True)

    def _take_free(self) -> None:
        now = time.monotonic()
        if now - self._taken_at > JOIN_PERIOD / 4:
            self._taken_at = now
            self.ask("take", quiet=True)

    def _check_silence(self) -> None:
        if self.state is not None and time.monotonic() - self.state.arrived > SILENCE:
            self.state = None
            self.changed.emit()

    def _live(self) -> None:
        if time.monotonic() - self._sent_at > LIFE_PERIOD / 2000.0:
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
        if self.account is None or self.state is None or self._joining == self.state.epoch or now < self._join_at:
            return
        account, epoch = self.account, self.state.epoch
        self._joining, self._join_at = epoch, now + UNANSWERED_PERIOD
        side = WindowSide(account.name, self._link.node_name, account.credential)

        def offered(answer: Answer) -> None:
            if account is not self.account or self._joining != epoch or not answer.ok:
                finish(answer.text, answered=answer.value is not None)
                return
            session, lease_key, _ = answer.value
            try:
                key = side.session_key(session, lease_key)
            except ValueError:  # a point of low order, or a session that is no ASCII
                finish(IMPOSTOR)
                return
            proven = lambda answer: joined(answer, session, key)  # noqa: E731
            self._link.call("join", side.claim, session, sign_join(key), then=proven)

        def joined(answer: Answer, session: str, key: bytes) -> None:
            if account is not self.account or self._joining != epoch or not answer.ok:
                finish(answer.text, answered=answer.value is not None)
            elif not hmac.compare_digest(answer.value[2], sign_joined(key)):
                finish(IMPOSTOR)
            else:
                self._join_at, self._missed_at = -math.inf, math.inf
                self._session, self._key, self._epoch = session, key, epoch
                self._number = self._asked = 0
                finish("")
                self._send(None)

        def finish(problem: str, answered: bool = True) -> None:
            if self._joining != epoch:
                return  # another drive_lease has come, and is asked
            self._joining = ""
            if problem and answered:
                self._join_at = time.monotonic() + JOIN_PERIOD
            if account is self.account:
                self._join_problem = problem
                self.changed.emit()

        self._link.call("join", side.claim, then=offered)
