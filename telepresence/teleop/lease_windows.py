"""The windows that have joined the drive lease: who they are, and how long they are known. See
`telepresence.teleop.drive_lease`."""

from __future__ import annotations

import hmac
import math
import re
import secrets
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field

from telepresence.security.signing import Received
from telepresence.teleop.key_agreement import KEY, Claim, LeaseSide
from telepresence.teleop.lease_messages import Account, Offer, Reply, sign_join

LEASE = 1.0
"""Seconds without a sign of life after which the pilot's lease ends, and a window counts as silent."""
FORGOTTEN = 30.0
"""Seconds of silence after which a window is forgotten."""
OFFER = 10.0
"""Seconds for which a window may prove itself after the lease's offer."""
ENDED = 60.0
"""Seconds for which a window that was sent away can ask why."""
MOST_WINDOWS, MOST_OF_ONE = 32, 8
"""Windows that have proven themselves, and those of one account."""
NOT_ACCEPTED = "This robot does not accept this name with this password. Sign in again, or ask who keeps its accounts."
_NODE = re.compile(r"/[A-Za-z0-9_/]{1,200}")
_SESSION = re.compile(r"([0-9a-f]{1,12})-[0-9a-f]{16}")


@dataclass(eq=False)
class Window:
    """A window that has proven its account."""

    session: str
    account: Account
    node: str
    key: bytes = field(repr=False)
    received: Received = field(repr=False)
    """Commands and requests are counted on their own, because the two use different channels."""
    last_message: float
    offset: float = math.inf
    """Least difference seen between our clock and its own [s]."""
    measured: float = 0.0
    hold: str = ""


class Windows:
    """Lets windows join, and forgets them.

    Args:
        find_account: Returns the account of a name, or None.
        private: The lease's own key, by which windows recognize it.
    """

    def __init__(self, find_account: Callable[[str], Account | None], private: bytes) -> None:
        self._find_account = find_account
        self._agreement = LeaseSide(private)
        self._windows: dict[str, Window] = {}
        self._joined: dict[str, float] = {}
        """When each session joined that could still be offered: nobody joins twice with one proof."""
        self._ended: dict[str, tuple[Window, str, float]] = {}
        """Windows that were sent away, why, and when."""

    def __iter__(self) -> Iterator[Window]:
        return iter(list(self._windows.values()))

    def get(self, session: str) -> Window | None:
        """Return the window of a session."""
        return self._windows.get(session)

    def ended(self, session: str) -> tuple[Window | None, str]:
        """Return a window that was sent away lately, and why."""
        return self._ended.get(session, (None, "", 0.0))[:2]

    def set_private(self, private: bytes) -> None:
        """Use another key of the lease."""
        self._agreement.set_private(private)

    def present(self, now: float) -> list[Window]:
        """Return the windows that are not silent."""
        return [window for window in self if now - window.last_message <= LEASE]

    def offer(self, claim: Claim, now: float) -> Offer:
        """Offer a session to whoever asks, known or not. Nothing is kept of it, so any number may ask."""
        if len(claim.key) != KEY:
            return Offer("", b"", f"The key must have {KEY} bytes, not {len(claim.key)}.")
        session = f"{int(now * 1000):x}-{secrets.token_hex(8)}"
        return Offer(session, self._agreement.offer(claim, session))

    def prove(self, claim: Claim, session: str, proof: bytes, now: float) -> Window | Reply:
        """Return the window that has proven its account, for `admit`; or why it has not. Changes nothing, so that it
        may run, and read the accounts, beside everything else."""
        offered = _SESSION.fullmatch(session)
        if offered is None or not 0.0 <= now - int(offered[1], 16) / 1000 <= OFFER:
            return Reply(False, "This robot's offer has run out; the window joins again by itself.")
        if not _NODE.fullmatch(claim.node):
            return Reply(False, "This is no name of a window's node.")
        account = self._find_account(claim.name)
        try:
            key = self._agreement.session_key(claim, session, account.public if account else b"")
        except ValueError:  # a point of low order
            return Reply(False, NOT_ACCEPTED)
        if not hmac.compare_digest(proof, sign_join(key)) or account is None:
            return Reply(False, NOT_ACCEPTED)
        return Window(session, account, claim.node, key, Received(key), now)

    def admit(self, window: Window, pilot: Window | None, now: float) -> Reply:
        """Give a window that has proven its account a place. Those in excess lose theirs, but not the pilot's."""
        self._forget(pilot, now)
        if window.session in self._joined:
            return Reply(False, "This window has joined already.")
        others = [other for other in self if other is not pilot]
        own = [other for other in others if other.account.name == window.account.name]
        again = [other for other in own if other.node == window.node]
        if len(own) - len(again) >= MOST_OF_ONE:
            again.append(min(own, key=lambda other: other.last_message))
        elif len(self._windows) - len(again) >= MOST_WINDOWS:
            silent = [other for other in others if now - other.last_message > LEASE]
            if not silent:
                return Reply(False, f"There are {MOST_WINDOWS} windows already. Close one.")
            again.append(min(silent, key=lambda other: other.last_message))
        for other in again:
            self.remove(other)
        self._windows[window.session], self._joined[window.session] = window, now
        return Reply(True)

    def outdated(self, sessions: Collection[str], accounts: Mapping[str, Account], now: float) -> list[Window]:
        """Return those of the windows whose account is not any more what it was when they joined; they can ask why."""
        outdated = []
        for window in self:
            if window.session not in sessions:
                continue
            then, today = window.account, accounts.get(window.account.name)
            if today == then:
                continue
            if today is None:
                reason = f"The account of {then.name} was removed from this robot."
            elif today.public != then.public:
                reason = f"The password of {then.name} was changed. Sign in again."
            else:
                reason = f"Role or rank of {then.name} was changed. Sign in again."
            self._ended[window.session] = (window, reason, now)
            outdated.append(window)
        return outdated

    def remove(self, window: Window) -> None:
        """Forget a window that leaves."""
        self._windows.pop(window.session, None)

    def _forget(self, pilot: Window | None, now: float) -> None:
        for window in self:
            if now - window.last_message > FORGOTTEN and window is not pilot:
                self.remove(window)
        self._joined = {session: at for session, at in self._joined.items() if now - at <= OFFER}
        self._ended = {session: entry for session, entry in self._ended.items() if now - entry[2] <= ENDED}
