"""The drive lease decides who may drive: one pilot at a time. No ROS, no clock: the time is an argument.

Every window joins under a name (`key_agreement`), and signs what it sends with a key that only who knows the account's
password can have; neither a watcher, nor who reads the accounts, nor a program that only listens can send as somebody
else, or send again what was sent before. The pilot's window renews the lease with every message; a second of silence
frees the robot. Whenever the pilot changes, the robot gets a zero first.

Keyboards and gamepads that publish velocities on their own rank last: they drive while no window does. Messages
and services: telepresence_msgs/msg and telepresence_msgs/srv.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from telepresence.geometry import ZERO_VELOCITY as ZERO
from telepresence.geometry import Velocity
from telepresence.security.signing import PROOF, Check
from telepresence.teleop.command_timeout import ZEROS_TIME
from telepresence.teleop.key_agreement import EVERYBODY, Claim
from telepresence.teleop.lease_messages import (
    MOST_TEXT,
    PILOT,
    Account,
    Offer,
    Reply,
    SignedCommand,
    as_bytes,
    command_parts,
    outranks,
    sign_reply,
)
from telepresence.teleop.lease_windows import LEASE, Window, Windows
from telepresence.teleop.looking import Look, LookCommand, look_part

COMMAND_AGE = 0.3
"""Seconds for which a velocity is valid. Windows repeat it every 0.05 s."""
LATE = 0.5
"""Seconds by which a command may be later than the fastest one of its window: a network that recovers delivers
everything that was queued."""
DRIFT = 1e-3
"""Largest drift between two clocks, seconds per second."""
OTHER_TIME = 0.5
"""Seconds for which another program's velocity counts as driving."""


@dataclass(frozen=True)
class LeaseSnapshot:
    """What is published about the lease.

    Args:
        pilot, window: Name of the pilot, and the node of the pilot's window.
        asking: Name of who has asked to take over.
        stopped_by: Name of who has pressed the red stop.
        hold: Why nobody may drive now; empty if somebody may.
        other: Node of another program that drives past the lease.
        velocity: Sent last.
        present: Names with roles; `windows`: the nodes of their windows.
    """

    pilot: str = ""
    window: str = ""
    asking: str = ""
    stopped_by: str = ""
    hold: str = ""
    other: str = ""
    velocity: Velocity = ZERO
    present: tuple[str, ...] = ()
    windows: tuple[str, ...] = ()


class DriveLease:
    """Decides which window's commands reach the robot.

    Args:
        find_account: Returns the account of a name, or None.
        private: The lease's own key, by which windows recognize it.
    """

    def __init__(self, find_account: Callable[[str], Account | None], private: bytes = EVERYBODY) -> None:
        self._windows = Windows(find_account, private)
        self._pilot: Window | None = None
        self._asking: Window | None = None
        self._stopper: Account | None = None
        self._velocity, self._velocity_at = ZERO, -math.inf
        self._zeros_until = -math.inf
        self._other, self._other_at = "", -math.inf
        self._held = False
        self.refused = 0
        """Messages that were not obeyed: unknown, forged, repeated, late, not finite, not by the pilot."""

    def offer(self, claim: Claim, now: float) -> Offer:
        """Offer a session to whoever asks, see `Windows.offer`. May run beside everything else."""
        return self._windows.offer(claim, now)

    def prove(self, claim: Claim, session: str, proof: bytes, now: float) -> Window | Reply:
        """Check a window's proof, see `Windows.prove`. May run beside everything else."""
        return self._windows.prove(claim, session, proof, now)

    def admit(self, window: Window, now: float) -> Reply:
        """Let a window join that has proven its account."""
        return self._windows.admit(window, self._pilot, now)

    def keep_stop(self, account: Account) -> None:
        """Hold the red stop that this account has pressed at an earlier lease, which died."""
        self._stopper = account

    def set_private(self, private: bytes) -> None:
        """Prove to windows that join from now on with this key of the lease."""
        self._windows.set_private(private)

    def sessions(self) -> set[str]:
        """Return the sessions of all windows."""
        return {window.session for window in self._windows}

    def names(self) -> set[str]:
        """Return the names of everybody who has a window."""
        return {window.account.name for window in self._windows}

    def revise(self, sessions: Collection[str], accounts: Mapping[str, Account], now: float) -> None:
        """End those of the sessions whose accounts are not any more what they were when their windows joined.

        Args:
            sessions: Those that had joined when the accounts were read.
            accounts: Those of everybody who had a window then, by name.
        """
        for window in self._windows.outdated(sessions, accounts, now):
            self._leave(window, now)

    def receive(self, session: str, command: SignedCommand, now: float) -> Velocity | None:
        """Take a window's command; return the velocity to send to the robot at once, or None."""
        window = self._windows.get(session)
        if (
            window is None
            or not _is_sound(command)
            or not self._is_genuine(window, command, now, "command", *command_parts(command))
        ):
            self.refused += 1
            return None
        window.hold = command.hold
        if window is self._pilot and command.hold and not self._held:
            self._zeros_until = now + ZEROS_TIME
        self._held = bool(self._pilot is not None and self._pilot.hold)
        if command.velocity is None:
            return None
        if window is not self._pilot or self._stopper or (self._held and any(command.velocity)):
            self.refused += 1
            return None
        self._zeros_until = -math.inf
        return self._give(command.velocity, now)

    def look(self, session: str, command: LookCommand, now: float) -> Look | None:
        """Take where a window wants to look; return it if the head is to turn there. Whoever may drive may look."""
        window = self._windows.get(session)
        if window is None or not self._is_genuine(window, command, now, "look", look_part(command)):
            self.refused += 1
            return None
        if window is not self._pilot or self._hold_reason() or not all(map(math.isfinite, command.look)):
            self.refused += 1
            return None
        return command.look

    def ask(self, session: str, number: int, action: str, to: str, proof: bytes, now: float) -> Reply:
        """Carry out a signed request.

        Args:
            action: take, release, give, keep, stop, reset_stop, leave, or present, which changes nothing.
            to: For give: the node of a window; empty for whoever has asked.
        """
        window, ended = self._windows.get(session), ""
        if window is None:
            window, ended = self._windows.ended(session)
        if window is None:
            return Reply(False, "This robot does not know this window any more; it joins again by itself.")
        check = window.received.check(proof, "request", number, as_bytes(action), as_bytes(to))
        if check is Check.FORGED:
            self.refused += 1
            return Reply(False, "This request is not signed by the window that it is for.")
        if check is Check.REPEATED:
            self.refused += 1
            return Reply(False, "A later request was here first. Ask again.")
        if ended:
            return Reply(False, ended, ended=True)
        window.last_message = now
        actions = {
            "take": lambda: self._take(window, now),
            "release": lambda: self._release(window, now),
            "give": lambda: self._hand_over(window, to, now),
            "keep": lambda: self._keep(window),
            "stop": lambda: self._stop(window, now),
            "reset_stop": lambda: self._reset_stop(window),
            "leave": lambda: self._leave(window, now),
            "present": lambda: Reply(True),
        }
        if action not in actions:
            return Reply(False, f"There is no {action[:MOST_TEXT]!r}; there are {', '.join(actions)}.")
        return actions[action]()

    def sign(self, session: str, number: int, reply: Reply) -> bytes:
        """Return the proof that belongs in the answer to a request, made with the key of the window that asked; zeros
        if there is no such window."""
        window = self._windows.get(session) or self._windows.ended(session)[0]
        return sign_reply(window.key, number, reply) if window else bytes(PROOF)

    def receive_other(self, node: str, velocity: Velocity, now: float) -> Velocity | None:
        """Take a velocity that another program has sent past the lease; return what to send against it, or None."""
        if not any(velocity):
            return None
        self._other, self._other_at = node, now
        return ZERO if self._hold_reason() else None

    def lost(self, node: str, now: float) -> Velocity | None:
        """Report that the connection of a window has closed: it was killed, or the network broke. The windows of a
        node, as browsers are of the page's, are called `node` and a name of their own.

        Its motion ends at once, not `COMMAND_AGE` later; its lease continues, in case it comes back.

        Returns:
            The velocity to send to the robot, or None.
        """
        if self._pilot is None or not f"{self._pilot.node}/".startswith(f"{node}/") or not any(self._velocity):
            return None
        self._zeros_until = now + ZEROS_TIME
        return self._give(ZERO, now)

    def tick(self, now: float) -> Velocity | None:
        """Check the timeouts, 20 times a second or more; return the velocity to send to the robot, or None."""
        pilot = self._pilot
        if pilot is not None and now - pilot.last_message > LEASE:
            self._set_pilot(None, now)
        if any(self._velocity) and now - self._velocity_at > COMMAND_AGE:
            return self._give(ZERO, now)
        return self._give(ZERO, now) if now < self._zeros_until else None

    def state(self, now: float) -> LeaseSnapshot:
        """Return the state at `now` [s]."""
        pilot, asking = self._pilot, self._asking
        here = self._windows.present(now)
        present = sorted((f"{w.account.name} ({w.account.role})", w.node) for w in here)
        return LeaseSnapshot(
            pilot=pilot.account.name if pilot else "",
            window=pilot.node if pilot else "",
            asking=asking.account.name if asking and now - asking.last_message <= LEASE else "",
            stopped_by=self._stopper.name if self._stopper else "",
            hold=self._hold_reason(),
            other=self._other if now - self._other_at <= OTHER_TIME else "",
            velocity=self._velocity,
            present=tuple(name for name, _ in present),
            windows=tuple(node for _, node in present),
        )

    # --- requests ---

    def _take(self, window: Window, now: float) -> Reply:
        pilot = self._pilot
        if window.account.role != PILOT:
            return Reply(False, f"{window.account.name} may watch, not drive.")
        if pilot is None or pilot.account.name == window.account.name or window.account.rank > pilot.account.rank:
            if pilot is not window:
                self._set_pilot(window, now)
            return Reply(True)
        self._asking = window
        return Reply(False, f"{pilot.account.name} drives and has been asked to hand over.")

    def _release(self, window: Window, now: float) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        self._set_pilot(None, now)
        return Reply(True)

    def _hand_over(self, window: Window, to: str, now: float) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        here = self._windows.present(now)
        taker = next((w for w in here if (w.node == to if to else w is self._asking)), None)
        if taker is None:
            return Reply(False, f"{'That window' if to else 'Who asked'} is not here any more.")
        if taker.account.role != PILOT:
            return Reply(False, f"{taker.account.name} may watch, not drive.")
        self._set_pilot(taker, now)
        return Reply(True)

    def _keep(self, window: Window) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        self._asking = None
        return Reply(True)

    def _stop(self, window: Window, now: float) -> Reply:
        if self._stopper is None or outranks(window.account, self._stopper):
            self._stopper = window.account
        self._velocity, self._velocity_at = ZERO, now
        self._zeros_until = now + ZEROS_TIME
        return Reply(True)

    def _reset_stop(self, window: Window) -> Reply:
        """Reset a stop for who pressed it, in whatever session, or for a higher rank; a watcher's for the pilot too."""
        account, stopper, pilot = window.account, self._stopper, self._pilot
        if account.role != PILOT:
            return Reply(False, f"{account.name} may stop the robot; only a pilot can reset the stop.")
        if stopper is not None and stopper.name != account.name:
            if not outranks(account, stopper):
                return Reply(
                    False, f"{stopper.name} has pressed the red stop: {stopper.name} or a higher rank resets it."
                )
            if pilot is not None and pilot.account.name != account.name and not outranks(account, pilot.account):
                return Reply(False, f"{pilot.account.name} drives; only {pilot.account.name} can reset the stop.")
        self._stopper = None
        return Reply(True)

    def _leave(self, window: Window, now: float) -> Reply:
        if window is self._pilot:
            self._set_pilot(None, now)
        if window is self._asking:
            self._asking = None
        self._windows.remove(window)
        return Reply(True)

    # --- checks and transitions ---

    def _is_genuine(
        self, window: Window, command: SignedCommand | LookCommand, now: float, purpose: str, *parts: bytes
    ) -> bool:
        """Whether a message is signed by this window, new and not late; it renews the window's lease, too."""
        if window.received.check(command.proof, purpose, command.number, *parts) is not Check.GOOD:
            return False
        if not math.isfinite(command.sent):
            return False
        drift = DRIFT * max(0.0, now - window.measured)
        window.offset, window.measured = min(window.offset + drift, now - command.sent), now
        if now - command.sent - window.offset > LATE:
            return False
        window.last_message = now
        return True

    def _set_pilot(self, window: Window | None, now: float) -> None:
        self._pilot, self._asking = window, None
        self._held = bool(window is not None and window.hold)
        self._velocity, self._velocity_at = ZERO, now
        self._zeros_until = now + ZEROS_TIME

    def _give(self, velocity: Velocity, now: float) -> Velocity:
        self._velocity, self._velocity_at = velocity, now
        return velocity

    def _hold_reason(self) -> str:
        if self._stopper is not None:
            return f"{self._stopper.name} has pressed the red stop."
        return self._pilot.hold if self._pilot is not None else ""


def _is_sound(command: SignedCommand) -> bool:
    """Whether a command says something that can be done and shown."""
    if not all(map(math.isfinite, command.velocity or ZERO)):
        return False
    return len(command.hold) <= MOST_TEXT and command.hold.isprintable()
