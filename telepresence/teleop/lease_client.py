"""A window's side of drive_lease: joins it, asks for the robot, and signs commands. No ROS, no Qt.

The other side is `telepresence.teleop.drive_lease`; how they reach each other is a `LeaseLink`. Everything happens on
one thread. Whoever owns a client calls `check` several times a second, and `renew` at least every `LIFE_PERIOD` while
the window lives: a window that hangs loses the robot.
"""

from __future__ import annotations

import dataclasses
import hmac
import math
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from telepresence.geometry import Velocity
from telepresence.security.signing import PROOF
from telepresence.teleop.key_agreement import WindowSide
from telepresence.teleop.lease_link import Answer, LeaseLink
from telepresence.teleop.lease_messages import (
    MOST_TEXT,
    PILOT,
    Account,
    Reply,
    SignedCommand,
    sign_command,
    sign_join,
    sign_joined,
    sign_reply,
    sign_request,
)
from telepresence.teleop.lease_topics import LeaseState
from telepresence.teleop.lease_windows import LEASE
from telepresence.teleop.looking import Look, LookCommand, sign_look
from telepresence.teleop.request_to_drive import RequestToDrive

LIFE_PERIOD = 0.25
"""[s] between two renewals; a lease lasts four of them."""
SILENCE = 0.7
"""[s] without a message from drive_lease, which repeats its state every 0.2 s, after which it counts as gone."""
JOIN_PERIOD = 2.0
"""[s] between two attempts to join after a refusal."""
UNANSWERED_PERIOD = 0.2
"""[s] between two attempts to join that nobody has answered: drive_lease was just started, or has died meanwhile."""
MISSED = 0.2
"""[s] for which `drive/state` may lack this window before it asks why."""
AT_ONCE = ("stop", "leave")
"""Requests that wait for no answer to others."""
STOP_OWED = 3.0
"""[s] for which a red stop that drive_lease did not answer, as it was killed for example, is kept for the next one."""
IMPOSTOR = "What answers as drive_lease cannot prove that it is this robot's: somebody else may pretend to be it."


def _seconds() -> float:
    """Return the time [s] that dates what is sent. Its clock goes on while the computer sleeps: otherwise every command
    would look late afterwards."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class _Request(NamedTuple):
    """A request that is on its way: in which session it was asked, and for whom."""

    number: int
    session: str
    key: bytes
    account: Account | None
    action: str
    quiet: bool

    def is_proven(self, answer: Answer) -> bool:
        """Return whether the drive_lease of the session has answered, and nobody else."""
        if answer.value is None:
            return False
        reply = Reply(answer.ok, answer.text, answer.value.ended)
        return hmac.compare_digest(answer.value.proof, sign_reply(self.key, self.number, reply))


class _Joining(NamedTuple):
    """A window that is about to join: for whom, at which drive_lease, and its side of the agreement on a key."""

    account: Account
    epoch: str
    side: WindowSide


class LeaseClient:
    """Whether one window has the robot, and how it gets it.

    Args:
        changed: Called when `state`, `mine` or `obstacle` has changed.
        refused: Called with a sentence when a request was refused.
        ended: Called with a sentence when the account was removed or changed, and acts no more.
        own_clock: This program's clock dates what is sent. Otherwise only `command` sends anything: two clocks in one
            session would make the newest command look old.
    Attributes:
        account: Who acts; None for nobody.
        state: Who drives; None when drive_lease is silent.
    """

    def __init__(
        self,
        link: LeaseLink,
        changed: Callable[[], object],
        refused: Callable[[str], object],
        ended: Callable[[str], object],
        own_clock: bool = True,
    ) -> None:
        self._link, self._own_clock = link, own_clock
        self._changed, self._refused, self._ended = changed, refused, ended
        self.account: Account | None = None
        self.state: LeaseState | None = None
        self._session, self._key, self._epoch = "", b"", ""
        self._number = self._asked = self._looked = 0
        self._unanswered: set[int] = set()
        self._waiting: deque[tuple[str, str, bool]] = deque()
        self._stop_owed_until = -math.inf
        """A red stop that no drive_lease has heard of is asked for again when the next one is joined, until then."""
        self._hold = ""
        self._wants = False
        self._joining = ""
        """The epoch of the drive_lease that is asked to let this window join."""
        self._sent_at = self._join_at = self._taken_at = -math.inf
        self._join_problem = ""
        self._missed_at = math.inf
        self._request_to_drive = RequestToDrive()

    @property
    def is_pilot(self) -> bool:
        return self.account is not None and self.account.role == PILOT

    @property
    def session(self) -> str:
        """The session in which this window has joined; empty for none."""
        return self._session

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
            return f"{self.state.stopped_by} has pressed the red stop. Press it again to reset the stop."
        return ""

    def sign_in(self, account: Account) -> None:
        """Act for this person from now on; a pilot takes the robot if it is free."""
        self.sign_out()
        self.account = account
        self._wants = account.role == PILOT
        self._join()
        self._changed()

    def sign_out(self) -> None:
        """Give up the robot, and act for nobody."""
        if self._session:
            self.ask("leave", quiet=True)
        self.account = None
        self._request_to_drive = RequestToDrive()
        self._session, self._join_problem = "", ""
        self._join_at = self._stop_owed_until = -math.inf
        self._changed()

    def set_hold(self, reason: str) -> None:
        """Let nobody drive for this reason while this window has the robot, not even a keyboard node."""
        if reason[:MOST_TEXT] != self._hold:
            self._hold = reason[:MOST_TEXT]
            self._send(None)

    def drive(self, vx: float, vy: float, wz: float) -> None:
        """Send a velocity: forward, left [m/s], counter-clockwise [rad/s]. It has to be repeated, see
        `telepresence.teleop.drive_lease`."""
        self._send(Velocity(vx, vy, wz))

    def command(self, velocity: Velocity | None, hold: str, sent: float) -> None:
        """Send what somebody else's controls say, dated by their clock [s]; it renews the lease, too."""
        self._hold = hold
        self._send(velocity, sent)

    def look(self, look: Look, sent: float | None = None) -> None:
        """Send where this window wants to look; to be repeated, see `telepresence.teleop.looking`. `sent` [s]: by the
        clock that dates the commands, if that is somebody else's."""
        if not self._session or (sent is None and not self._own_clock):
            return
        self._looked += 1
        unsigned = LookCommand(self._looked, _seconds() if sent is None else sent, look)
        self._link.send_look(self._session, dataclasses.replace(unsigned, proof=sign_look(self._key, unsigned)))

    def take(self) -> None:
        """Take the robot, or ask the pilot for it."""
        self._wants = True
        self.ask("take")

    def release(self) -> None:
        """Release the robot for others."""
        self._wants = False
        self.ask("release")

    def ask(self, action: str, to: str = "", quiet: bool = False) -> None:
        """Send a request, see `DriveLease.ask`; a refusal is reported by `refused`.

        Requests go one after the other, each when the one before is answered: drive_lease refuses one that another has
        overtaken on the way.
        """
        if not self._session:
            if not quiet:
                self._refused(self.obstacle() or "This window has not joined yet; try again in a moment.")
            return
        if action == "stop":  # a reset that was asked for before must not follow it
            self._waiting = deque(each for each in self._waiting if each[0] != "reset_stop")
        if self._unanswered and action not in AT_ONCE:
            self._waiting.append((action, to, quiet))
        else:
            self._request(action, to, quiet)

    def _request(self, action: str, to: str, quiet: bool) -> None:
        self._asked += 1
        request = _Request(self._asked, self._session, self._key, self.account, action, quiet)
        self._unanswered.add(request.number)
        proof = sign_request(request.key, request.number, action, to)
        self._link.ask(request.session, request.number, action, to, proof, partial(self._on_answer, request))

    def _on_answer(self, request: _Request, answer: Answer) -> None:
        self._take_answer(request, answer)
        if request.session == self._session:
            self._unanswered.discard(request.number)
            if self._waiting and not self._unanswered:
                self._request(*self._waiting.popleft())

    def _take_answer(self, request: _Request, answer: Answer) -> None:
        proven = request.is_proven(answer)
        if request.action == "stop" and request.account is self.account and not proven:
            self._owe_the_stop(request.session)
        if request.session != self._session or answer.value is None:  # asked before, or nobody has answered
            if not answer.ok and not request.quiet and request.session == self._session:
                self._refused(answer.text)
            return
        if not proven:
            # drive_lease has forgotten this window, or it is somebody else who answers: prove each other again.
            self._session = ""
            self._join()
        elif answer.value.ended:
            self._end(answer.text)
            return
        if not answer.ok and not request.quiet:
            self._refused(answer.text)

    def _owe_the_stop(self, session: str) -> None:
        """Ask the next drive_lease for the red stop that the one of this session has not confirmed."""
        self._stop_owed_until = time.monotonic() + STOP_OWED
        if self._session and self._session != session:  # the next one is joined already
            self._stop_again()

    def _stop_again(self) -> None:
        if time.monotonic() < self._stop_owed_until:
            self._stop_owed_until = -math.inf
            self.ask("stop")

    def _end(self, reason: str) -> None:
        """Act for nobody any more: the account was removed or changed."""
        self._session = ""
        self.sign_out()
        self._ended(reason)

    def receive(self, state: LeaseState) -> None:
        before, was_mine = self.state, self.mine
        self.state = state
        if state.epoch != self._epoch:
            self._session = ""
        self._ask_if_missed(state)
        heard = time.monotonic() - self._sent_at < LEASE
        if self.account is not None and self._request_to_drive.is_refused(state, self.account.name, heard):
            self._refused(f"{state.pilot} keeps the robot.")
        if self.account is not None and not self._session:
            self._join()
        if was_mine and state.pilot and not self.mine:
            self._wants = False  # it was handed over or taken: do not take it back as soon as it is free
            self._refused(f"{state.pilot} drives now.")
        if self._session and self._wants and not state.pilot and self._lives():
            self._take_free()
        if before is None or dataclasses.replace(state, arrived=before.arrived) != before:
            self._changed()

    def _ask_if_missed(self, state: LeaseState) -> None:
        if not self._session or any(node == self._link.node_name for _, node in state.present):
            self._missed_at = math.inf
            return
        now = time.monotonic()
        self._missed_at = min(self._missed_at, now)
        if now - self._missed_at >= MISSED:
            self._missed_at = now
            self.ask("present", quiet=True)

    def _lives(self) -> bool:
        """Whether somebody is there who could drive: whoever commands by another clock may have gone."""
        return self._own_clock or time.monotonic() - self._sent_at < LEASE

    def _take_free(self) -> None:
        now = time.monotonic()
        if now - self._taken_at > JOIN_PERIOD / 4:
            self._taken_at = now
            self.ask("take", quiet=True)

    def check(self) -> None:
        """Look whether drive_lease is silent."""
        if self.state is not None and time.monotonic() - self.state.arrived > SILENCE:
            self.state = None
            self._changed()

    def renew(self) -> None:
        """Send a sign of life, unless a command was sent lately."""
        if time.monotonic() - self._sent_at > LIFE_PERIOD / 2:
            self._send(None)

    def _send(self, velocity: Velocity | None, sent: float | None = None) -> None:
        if not self._session or (sent is None and not self._own_clock):
            return
        self._number += 1
        self._sent_at = time.monotonic()
        unsigned = SignedCommand(self._number, _seconds() if sent is None else sent, velocity, self._hold)
        command = dataclasses.replace(unsigned, proof=sign_command(self._key, unsigned))
        self._link.send(self._session, command)

    def _join(self) -> None:
        now = time.monotonic()
        if self.account is None or self.state is None or self._joining == self.state.epoch or now < self._join_at:
            return
        side = WindowSide(self.account.name, self._link.node_name, self.account.credential)
        joining = _Joining(self.account, self.state.epoch, side)
        self._joining, self._join_at = joining.epoch, now + UNANSWERED_PERIOD
        self._link.join(side.claim, "", bytes(PROOF), partial(self._on_offer, joining))

    def _on_offer(self, joining: _Joining, answer: Answer) -> None:
        if self._has_failed(joining, answer):
            return
        session = answer.value.session
        try:
            key = joining.side.session_key(session, answer.value.key)
        except ValueError:  # a point of low order, or a session that is no ASCII
            self._end_joining(joining, IMPOSTOR)
            return
        self._link.join(joining.side.claim, session, sign_join(key), partial(self._on_joined, joining, session, key))

    def _on_joined(self, joining: _Joining, session: str, key: bytes, answer: Answer) -> None:
        if self._has_failed(joining, answer):
            return
        if not hmac.compare_digest(answer.value.proof, sign_joined(key)):
            self._end_joining(joining, IMPOSTOR)
            return
        self._join_at, self._missed_at = -math.inf, math.inf
        self._session, self._key, self._epoch = session, key, joining.epoch
        self._number = self._asked = self._looked = 0
        self._unanswered.clear()
        self._waiting.clear()
        self._end_joining(joining, "")
        self._stop_again()
        self._send(None)

    def _has_failed(self, joining: _Joining, answer: Answer) -> bool:
        """Whether this is no answer to go on with; the joining is ended then."""
        if joining.account is self.account and joining.epoch == self._joining and answer.ok:
            return False
        self._end_joining(joining, answer.text, answered=answer.value is not None)
        return True

    def _end_joining(self, joining: _Joining, problem: str, answered: bool = True) -> None:
        if joining.epoch != self._joining:
            return  # another drive_lease has come, and is asked
        self._joining = ""
        if problem and answered:
            self._join_at = time.monotonic() + JOIN_PERIOD
        if joining.account is self.account:
            self._join_problem = problem
            self._changed()
