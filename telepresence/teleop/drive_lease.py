"""The drive lease decides who may drive: one pilot at a time. No ROS, no clock: the time is an argument.

Every window joins under a name, and signs what it sends with a key that follows from the account's key and two fresh
random numbers; neither a watcher nor a program that only listens can send as somebody else, or send again what was sent
before. The pilot's window renews the lease with every message; a second of silence frees the robot. Whenever the pilot
changes, the robot gets a zero first.

Keyboards and gamepads that publish velocities on their own rank last: they drive while no window does. Messages
and services: telepresence_msgs/msg and telepresence_msgs/srv.
"""

from __future__ import annotations

import math
import secrets
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from telepresence.geometry import ZERO_VELOCITY as ZERO
from telepresence.geometry import Velocity
from telepresence.teleop import signing
from telepresence.teleop.command_timeout import ZEROS_TIME
from telepresence.teleop.signing import NONCE, Check, Received

LEASE = 1.0
"""Seconds without a sign of life after which the pilot's lease ends."""
COMMAND_AGE = 0.3
"""Seconds for which a velocity is valid. Windows repeat it every 0.05 s."""
LATE = 0.5
"""Seconds by which a command may be later than the fastest one of its window: a network that recovers delivers
everything that was queued."""
DRIFT = 1e-3
"""Largest drift between two clocks, seconds per second."""
OTHER_TIME = 0.5
"""Seconds for which another program's velocity counts as driving."""
FORGOTTEN = 30.0
"""Seconds of silence after which a window is forgotten."""
MOST_WINDOWS = 32
PILOT, WATCHER = "pilot", "watcher"


@dataclass(frozen=True)
class Account:
    """A person who may join. A pilot of higher rank may take the robot from another one.

    Args:
        key: Shared by window and lease only; empty when names are not checked.
    """

    name: str
    role: str
    rank: int = 0
    key: bytes = field(default=b"", repr=False)


@dataclass(frozen=True)
class Command:
    """What a window sends, ten times a second or more while it drives and four times otherwise.

    Args:
        number: Counts up.
        sent: The window's own clock [s].
        velocity: None while no control is held.
        hold: Why nobody should drive by this window now, a picture that is lost for example; empty if nothing is wrong.
    """

    number: int
    sent: float
    velocity: Velocity | None
    hold: str
    proof: bytes = b""


class Reply(NamedTuple):
    """Whether a request was carried out; if not, a sentence for the person who made it."""

    ok: bool
    reason: str = ""


class Joined(NamedTuple):
    """The answer to a window that joins. `session` identifies it, `nonce` goes into its key; both empty if refused."""

    session: str
    nonce: bytes
    reason: str = ""


def session_key(account_key: bytes, window_nonce: bytes, lease_nonce: bytes) -> bytes:
    """Return the key with which a window signs from now on."""
    return signing.session_key(account_key, "drive lease", window_nonce, lease_nonce)


def sign_command(key: bytes, command: Command) -> bytes:
    """Return the proof that belongs into the command."""
    return signing.sign(key, "command", command.number, *_parts(command))


def sign_request(key: bytes, number: int, action: str, to: str = "") -> bytes:
    """Return the proof for `DriveLease.ask`."""
    return signing.sign(key, "request", number, action.encode(), to.encode())


def _parts(command: Command) -> tuple[bytes, bytes]:
    velocity = command.velocity or ZERO
    return struct.pack("<d?3d", command.sent, command.velocity is not None, *velocity), command.hold.encode()


@dataclass(eq=False)
class _Window:
    """A window that has joined."""

    session: str
    account: Account
    node: str
    received: Received = field(repr=False)
    """Commands and requests are counted on their own, because the two use different channels."""
    last_message: float
    offset: float = math.inf
    """Least difference seen between our clock and its own [s]."""
    measured: float = 0.0
    hold: str = ""
    proven: bool = False
    """Whether the window has shown that it knows the account's key."""


@dataclass(frozen=True)
class State:
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


def _outranks(account: Account, other: Account) -> bool:
    """Whether what one person has done may be undone by another: any pilot ranks above a watcher."""
    if account.role != other.role:
        return account.role == PILOT
    return account.rank > other.rank


class DriveLease:
    """Decides which window's commands reach the robot.

    Args:
        find_account: Returns the account of a name, or None.
    """

    def __init__(self, find_account: Callable[[str], Account | None]) -> None:
        self._find_account = find_account
        self._windows: dict[str, _Window] = {}
        self._pilot: _Window | None = None
        self._asking: _Window | None = None
        self._stopper: Account | None = None
        self._velocity, self._velocity_at = ZERO, -math.inf
        self._zeros_until = -math.inf
        self._other, self._other_at = "", -math.inf
        self._held = False
        self.refused = 0
        """Messages that were not obeyed: unknown, forged, repeated, late, not finite, not by the pilot."""

    def join(self, name: str, node: str, nonce: bytes, now: float) -> Joined:
        """Let a window join under a name. Its first signed message proves whether it may use the name."""
        account = self._find_account(name)
        if account is None:
            return Joined("", b"", f"This robot knows nobody called {name!r}. Sign in with a name it knows.")
        if len(nonce) != NONCE:
            return Joined("", b"", f"The random number must have {NONCE} bytes, not {len(nonce)}.")
        self._forget(now)
        if len(self._windows) >= MOST_WINDOWS:
            return Joined("", b"", f"There are {MOST_WINDOWS} windows already. Close one and wait {FORGOTTEN:.0f} s.")
        session, own_nonce = secrets.token_hex(8), secrets.token_bytes(NONCE)
        received = Received(session_key(account.key, nonce, own_nonce))
        self._windows[session] = _Window(session, account, node, received, now)
        return Joined(session, own_nonce)

    def receive(self, session: str, command: Command, now: float) -> Velocity | None:
        """Take a window's command; return the velocity to send to the robot at once, or None."""
        window = self._windows.get(session)
        if window is None or not self._is_genuine(window, command, now):
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

    def ask(self, session: str, number: int, action: str, to: str, proof: bytes, now: float) -> Reply:
        """Carry out a signed request.

        Args:
            action: take, release, give, keep, stop, reset_stop or leave.
            to: For give: the node of a window; empty for whoever has asked.
        """
        window = self._windows.get(session)
        if window is None:
            return Reply(False, "This robot does not know this window any more; it joins again by itself.")
        check = window.received.check(proof, "request", number, action.encode(), to.encode())
        if check is Check.FORGED:
            self.refused += 1
            return Reply(False, f"The robot knows another password for {window.account.name}. Sign in again.")
        if check is Check.REPEATED:
            self.refused += 1
            return Reply(False, "A later request was here first. Ask again.")
        window.last_message, window.proven = now, True
        actions = {
            "take": lambda: self._take(window, now),
            "release": lambda: self._release(window, now),
            "give": lambda: self._hand_over(window, to, now),
            "keep": lambda: self._keep(window),
            "stop": lambda: self._stop(window, now),
            "reset_stop": lambda: self._reset_stop(window),
            "leave": lambda: self._leave(window, now),
        }
        if action not in actions:
            return Reply(False, f"There is no {action!r}; there are {', '.join(actions)}.")
        return actions[action]()

    def receive_other(self, node: str, velocity: Velocity, now: float) -> Velocity | None:
        """Take a velocity that another program has sent past the lease; return what to send against it, or None."""
        if not any(velocity):
            return None
        self._other, self._other_at = node, now
        return ZERO if self._hold_reason() else None

    def lost(self, node: str, now: float) -> Velocity | None:
        """Report that the connection of a window has closed: it was killed, or the network broke.

        Its motion ends at once, not `COMMAND_AGE` later; its lease continues, in case it comes back.

        Returns:
            The velocity to send to the robot, or None.
        """
        if self._pilot is None or self._pilot.node != node or not any(self._velocity):
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

    def state(self, now: float) -> State:
        """Return the state at `now` [s]."""
        pilot, asking = self._pilot, self._asking
        here = (w for w in self._windows.values() if w.proven and now - w.last_message <= LEASE)
        present = sorted((f"{w.account.name} ({w.account.role})", w.node) for w in here)
        return State(
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

    def _take(self, window: _Window, now: float) -> Reply:
        pilot = self._pilot
        if window.account.role != PILOT:
            return Reply(False, f"{window.account.name} may watch, not drive.")
        if pilot is None or pilot.account.name == window.account.name or window.account.rank > pilot.account.rank:
            if pilot is not window:
                self._set_pilot(window, now)
            return Reply(True)
        self._asking = window
        return Reply(False, f"{pilot.account.name} drives and has been asked to hand over.")

    def _release(self, window: _Window, now: float) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        self._set_pilot(None, now)
        return Reply(True)

    def _hand_over(self, window: _Window, to: str, now: float) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        asking = [self._asking] if self._asking else []
        takers = [w for w in self._windows.values() if w.node == to] if to else asking
        taker = next((w for w in takers if w.proven and now - w.last_message <= LEASE), None)
        if taker is None:
            return Reply(False, f"{to or 'Who asked'} is not here any more.")
        if taker.account.role != PILOT:
            return Reply(False, f"{taker.account.name} may watch, not drive.")
        self._set_pilot(taker, now)
        return Reply(True)

    def _keep(self, window: _Window) -> Reply:
        if window is not self._pilot:
            return Reply(False, "You do not have the robot.")
        self._asking = None
        return Reply(True)

    def _stop(self, window: _Window, now: float) -> Reply:
        if self._stopper is None or _outranks(window.account, self._stopper):
            self._stopper = window.account
        self._velocity, self._velocity_at = ZERO, now
        self._zeros_until = now + ZEROS_TIME
        return Reply(True)

    def _reset_stop(self, window: _Window) -> Reply:
        """Reset a stop for who pressed it, in whatever session, or for a higher rank; a watcher's for the pilot too."""
        account, stopper, pilot = window.account, self._stopper, self._pilot
        if account.role != PILOT:
            return Reply(False, f"{account.name} may stop the robot; only a pilot lets it go again.")
        if stopper is not None and stopper.name != account.name:
            if not _outranks(account, stopper):
                return Reply(
                    False, f"{stopper.name} has pressed the red stop: {stopper.name} or a higher rank resets it."
                )
            if pilot is not None and pilot.account.name != account.name and not _outranks(account, pilot.account):
                return Reply(False, f"{pilot.account.name} drives; only {pilot.account.name} lets the robot go again.")
        self._stopper = None
        return Reply(True)

    def _leave(self, window: _Window, now: float) -> Reply:
        if window is self._pilot:
            self._set_pilot(None, now)
        if window is self._asking:
            self._asking = None
        del self._windows[window.session]
        return Reply(True)

    # --- checks and transitions ---

    def _is_genuine(self, window: _Window, command: Command, now: float) -> bool:
        if window.received.check(command.proof, "command", command.number, *_parts(command)) is not Check.GOOD:
            return False
        if not all(map(math.isfinite, (command.sent, *(command.velocity or ZERO)))):
            return False
        window.proven = True
        drift = DRIFT * max(0.0, now - window.measured)
        window.offset, window.measured = min(window.offset + drift, now - command.sent), now
        if now - command.sent - window.offset > LATE:
            return False
        window.last_message = now
        return True

    def _set_pilot(self, window: _Window | None, now: float) -> None:
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

    def _forget(self, now: float) -> None:
        for window in list(self._windows.values()):
            if now - window.last_message > FORGOTTEN and window is not self._pilot:
                del self._windows[window.session]
